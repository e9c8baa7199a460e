"""What a page that needs nothing from elsewhere must not hold; its own small scripts stand inside
it.
"""

FOREIGN = r"src=.http|<script[^>]+src|@import|url\(|fetch\(|XMLHttpRequest|import\(|WebSocket"
