"""What a file is that a reader cannot read, by how it begins: in words, with what to do."""

import re

_KINDS = (
    (rb"\x89HDF\r\n\x1a\n", "an HDF5 file; feeler info says what is in it"),
    (rb"\x89MCAP", "a ROS 2 recording (MCAP): feeler robot check and convert read it"),
    (rb"#ROSBAG V2", "a ROS 1 recording (bag): feeler robot check and convert read it"),
    (rb"#ROSBAG", "an old ROS 1 recording: mend it with rosbag fix, then feeler robot check"),
    (rb"SQLite format 3\0", "an SQLite file; as a ROS 2 recording feeler robot check reads it"),
    (
        rb"PK\x03\x04(?s:.*)(?:\[Content_Types\]|xl/|oasis.opendoc)|\xd0\xcf\x11\xe0",
        "a document (Excel, Word, OpenDocument): save a sheet of it as CSV in UTF-8",
    ),
    (
        rb"PK\x03\x04",
        "a ZIP archive (.npz, .zip): unpack it first; pickled content is never read",
    ),
    (rb"\x1f\x8b", "compressed by gzip: unpack it first, with gunzip"),
    (
        rb"BZh|\xfd7zXZ|\x28\xb5\x2f\xfd|7z\xbc\xaf|Rar!|(?s:.{257})ustar",
        "an archive, or compressed: unpack it first",
    ),
    (
        rb"version https://git-lfs",
        "a pointer of Git LFS, not the file: fetch it by git lfs pull",
    ),
    (rb"CDF[\x01\x02\x05]", "NetCDF-3: convert it with nccopy -k nc4, or by xarray"),
    (rb"MATLAB 7\.3", "MATLAB -v7.3: save it with '-v7', or as NetCDF"),
    (rb"MATLAB 5\.0", "a MATLAB file; feeler info says whether feeler wrote it"),
    (rb"\x93NUMPY", "a NumPy array: save it as CSV with a header row, by numpy.savetxt"),
    (rb"ARROW1|PAR1", "a table for programs (Parquet, Arrow): write it as CSV, by pandas"),
    (rb"\xff\xfe|\xfe\xff", "text in UTF-16: save it again as CSV in UTF-8"),
    (
        rb"(?s:.{4})(?:ftyp|wide|mdat|moov)|RIFF(?s:.{4})AVI |\x1a\x45\xdf\xa3"
        rb"|\0\0\x01\xba|\x30\x26\xb2\x75",
        "a film: track landmarks in it first (DeepLabCut, SLEAP), then feeler tracks",
    ),
    (rb"\x89PNG|\xff\xd8\xff|GIF8|II\*\0|MM\0\*|BM", "a picture, which holds no touches"),
    (rb"%PDF", "a PDF document"),
    (rb"\x80[\x02-\x05]", "a Python pickle, which can run programs when opened: never read"),
    (rb"RIFF(?s:.{4})WAVE", "a sound, which holds no touches"),
    (rb'\s*(?:\{\s*"|\[\s*[\[{"\d])', "JSON: write its tracks or readings as a CSV table"),
    (rb"\s*<(?:!|\?xml|html)", "a web page or XML, no table: export it as CSV"),
)


def name_start(start: bytes) -> str:
    """What a file is that begins so, with what to do; empty where nobody knows."""
    return next((words for magic, words in _KINDS if re.match(magic, start)), "")
