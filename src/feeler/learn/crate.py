"""RO-Crate: a file beside a store by which archives and search engines know what it holds."""

import json
import os
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import xarray as xr

from feeler.disk.files import parse_json, read_bytes
from feeler.disk.provenance import LICENCE, find_version
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.tensors.disk import write_atomic
from feeler.tensors.formats import load

_MAX_BYTES = 16 * 2**20  # [C]
_PAPER = "https://doi.org/10.1101/2025.10.20.683587"
_LICENCES = {
    "CC0-1.0": "https://creativecommons.org/publicdomain/zero/1.0/",
    "CC-BY-4.0": "https://creativecommons.org/licenses/by/4.0/",
}


@checked
def write_crate(
    store: str | os.PathLike, *, name: str = "", description: str = "", author: str = ""
) -> Path:
    """Write ``ro-crate-metadata.json`` into the folder that holds a store, and give back where it
    is.

    Follows RO-Crate 1.1 (https://w3id.org/ro/crate/1.1): the data set with its licence and the
    software that made it, and each variable and label with its unit.

    Raises
    ------
    InvalidInput
        No store, or the folder already has a crate that describes something else.
    """
    path = Path(store)
    tensors, place = load(path), path.absolute().parent / "ro-crate-metadata.json"
    if place.exists() and not _is_ours(place, path.name):
        raise InvalidInput(
            f"{place} describes something else. Put the store into a folder of its own."
        )
    write_atomic(
        place,
        json.dumps(
            _make_crate(tensors, path.name, name, description, author), indent=2
        ).encode(),
    )
    return place


def _is_ours(place: Path, store: str) -> bool:
    try:
        graph = parse_json(read_bytes(place, _MAX_BYTES), str(place))["@graph"]
        return any(item.get("@id") == f"{store}/" for item in graph)
    except (ValueError, KeyError, TypeError, AttributeError):
        return False


def _make_crate(
    tensors: xr.Dataset, store: str, name: str = "", description: str = "", author: str = ""
) -> dict[str, Any]:
    """The content of a crate for a store of this name."""
    sizes = ", ".join(
        f"{size} {dim}s" for dim, size in tensors.sizes.items() if dim in ("trial", "sensor")
    )
    licence = str(tensors.attrs.get("licence", LICENCE))
    words = (
        description
        or f"Simulated touches of insect-like antennae: {sizes},"
        f" {tensors.sizes.get('time', 0)} samples each."
    )
    variables = [_describe(str(key), item) for key, item in tensors.variables.items()]
    root: dict[str, Any] = {
        "@id": "./",
        "@type": "Dataset",
        "name": name or store,
        "description": words,
        "datePublished": datetime.now(UTC).date().isoformat(),
        "license": {"@id": _LICENCES.get(licence, licence)},
        "hasPart": [{"@id": f"{store}/"}],
        "citation": {"@id": _PAPER},
    }
    people = [{"@id": "#author", "@type": "Person", "name": author}] if author else []
    root |= {"author": {"@id": "#author"}} if author else {}
    return {
        "@context": "https://w3id.org/ro/crate/1.1/context",
        "@graph": [
            {
                "@id": "ro-crate-metadata.json",
                "@type": "CreativeWork",
                "conformsTo": {"@id": "https://w3id.org/ro/crate/1.1"},
                "about": {"@id": "./"},
            },
            root,
            {
                "@id": f"{store}/",
                "@type": "Dataset",
                "name": store,
                "description": (
                    "Zarr version 3 group; open it with xarray.open_zarr or feeler.load."
                ),
                "variableMeasured": [{"@id": item["@id"]} for item in variables],
            },
            *variables,
            *_make_origin(store, str(tensors.attrs.get("versions", ""))),
            {
                "@id": _PAPER,
                "@type": "ScholarlyArticle",
                "url": _PAPER,
                "name": "The paper that feeler follows",
            },
            {"@id": _LICENCES.get(licence, licence), "@type": "CreativeWork", "name": licence},
            *people,
        ],
    }


def _make_origin(store: str, versions: str) -> list[dict[str, Any]]:
    """The run that made a store, and the program that ran."""
    software = "#feeler"
    return [
        {
            "@id": "#made",
            "@type": "CreateAction",
            "name": "simulation",
            "instrument": {"@id": software},
            "result": {"@id": f"{store}/"},
            "description": versions,
        },
        {
            "@id": software,
            "@type": "SoftwareApplication",
            "name": "feeler",
            "version": find_version("feeler"),
            "citation": {"@id": _PAPER},
        },
    ]


def _describe(name: str, item: xr.Variable) -> dict[str, Any]:
    about = {
        "@id": f"#{name}",
        "@type": "PropertyValue",
        "name": name,
        "description": str(item.attrs.get("long_name", name)),
    }
    return about | ({"unitText": str(item.attrs["units"])} if "units" in item.attrs else {})
