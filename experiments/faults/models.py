"""Spoiled model folders: by chance, and by one who knows how a model is sealed."""

from __future__ import annotations

import json
import struct
from random import Random
from typing import Any

from experiments.faults import mutate
from fogml.json_files import content_hash

_DTYPES = ("F64", "F32", "F16", "BF16", "I64", "I32", "U8", "BOOL", "F8_E5M2", "X")
_ITEM = {
    "F64": 8,
    "F32": 4,
    "F16": 2,
    "BF16": 2,
    "I64": 8,
    "I32": 4,
    "U8": 1,
    "BOOL": 1,
    "F8_E5M2": 1,
    "X": 8,
}
DOCUMENT, WEIGHTS = "model.json", "weights.safetensors"


def sealed(document: dict[str, Any], weights: bytes) -> dict[str, bytes]:
    """The two files of a model whose hash is right: anyone can work it out, so it is no proof of origin."""
    own = {key: value for key, value in document.items() if key != "sha256"}
    try:
        digest = content_hash(own, {WEIGHTS: weights})
    except (TypeError, ValueError):
        digest = "0" * 64  # what can't be hashed is no JSON either
    text = json.dumps({**own, "sha256": digest}, indent=1)
    return {DOCUMENT: text.encode("utf-8", errors="surrogatepass"), WEIGHTS: weights}


def spoiled_model(rng: Random, document: bytes, weights: bytes) -> tuple[dict[str, bytes], str]:
    """Files of a spoiled model, and the name of the one that was spoiled."""
    values = json.loads(document)
    pick = rng.random()
    if pick < 0.1:
        return {DOCUMENT: mutate.data(rng, document), WEIGHTS: weights}, DOCUMENT
    if pick < 0.2:
        return {DOCUMENT: mutate.document(rng, values, as_yaml=False), WEIGHTS: weights}, DOCUMENT
    if pick < 0.25:
        return {DOCUMENT: document, WEIGHTS: mutate.data(rng, weights)}, WEIGHTS
    if pick < 0.65:
        edited = mutate.tree(rng, values)
        return sealed(edited if isinstance(edited, dict) else values, weights), DOCUMENT
    if pick < 0.8:
        return sealed(values, mutate.data(rng, weights)), WEIGHTS
    return sealed(values, spoiled_tensors(rng, weights)), WEIGHTS


def spoiled_tensors(rng: Random, weights: bytes) -> bytes:
    """Weights of another type, shape, name or value, in a sound file."""
    size = struct.unpack("<Q", weights[:8])[0]
    header, data = json.loads(weights[8 : 8 + size]), bytearray(weights[8 + size :])
    names = [name for name in header if name != "__metadata__"]
    if not names:
        return mutate.data(rng, weights)
    name = rng.choice(names)
    way = rng.randrange(7)
    entry = header[name]
    begin, end = entry["data_offsets"]
    if way == 0:
        entry["dtype"] = rng.choice(_DTYPES)
        entry["shape"] = [(end - begin) // _ITEM[entry["dtype"]]]
    elif way == 1 and end - begin >= 8:
        at = begin + 8 * rng.randrange((end - begin) // 8)
        data[at : at + 8] = struct.pack(
            "<d", rng.choice((float("nan"), float("inf"), 1e308, -1e308, 5e-324, 0.0))
        )
    elif way == 2:
        header[mutate.word(rng)] = header.pop(name)
    elif way == 3:
        entry["shape"] = rng.choice(([1, *entry["shape"]], entry["shape"][::-1], [2**62], [-1], [], [0]))
    elif way == 4:
        entry["data_offsets"] = rng.choice(
            ([0, 2**62], [begin, begin], [end, begin], [-8, 0], [begin + 8, end + 8])
        )
    elif way == 5:
        header["__metadata__"] = {mutate.word(rng): mutate.word(rng)}
    else:
        del header[name]
    held = json.dumps(header).encode("utf-8", errors="surrogatepass")
    return struct.pack("<Q", len(held)) + held + bytes(data)
