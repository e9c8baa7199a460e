"""Questions beyond the paper, a folder each: what was declared beforehand (declared.toml), what was
measured (measure.py, results.json) and the section that the report shows of it (section.py).
"""
