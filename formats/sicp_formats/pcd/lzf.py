"""LZF decompression, as the compressed body of PCD files uses it.

The format is that of Lehmann's LibLZF: a control byte below 32 begins a run of literals, any other one a copy from up
to 8192 bytes before.
"""

from __future__ import annotations

__all__ = ["decompress"]


def decompress(packed: bytes, size: int) -> bytes:
    r"""Unpack bytes that must come to a known size.

    Parameters
    ----------
    packed
        The compressed bytes.
    size
        How many bytes they must unpack to; never more are made.

    Raises
    ------
    ValueError
        With the offset in `packed` and what is wrong: a copy from before the beginning, an end in the middle, or
        another size.

    >>> decompress(b"\x00a\x80\x00", 7)
    b'aaaaaaa'
    """
    unpacked = bytearray()
    position, end = 0, len(packed)
    while position < end:
        begin, control = position, packed[position]
        if control < 32:
            position += control + 2
            literals = packed[begin + 1 : position]
            if position > end:
                raise ValueError(begin, "a run of literals is cut short")
            unpacked += literals
        else:
            position = _copy(packed, begin, unpacked)
        if len(unpacked) > size:
            raise ValueError(begin, f"it unpacks to more than the declared {size} bytes")
    if len(unpacked) < size:
        raise ValueError(end, f"it unpacks to {len(unpacked)} of the declared {size} bytes")
    return bytes(unpacked)


def _copy(packed: bytes, begin: int, unpacked: bytearray) -> int:
    """Append what a back reference stands for; return the offset behind it."""
    control = packed[begin]
    long = control >= 224
    if begin + 2 + long > len(packed):
        raise ValueError(begin, "a back reference is cut short")
    length = (control >> 5) + 2 + (packed[begin + 1] if long else 0)
    distance = ((control & 31) << 8) + packed[begin + 1 + long] + 1
    first = len(unpacked) - distance
    if first < 0:
        raise ValueError(begin, "a back reference points before the beginning")
    chunk = unpacked[first : first + length]
    if distance < length:  # it copies what it has just written
        chunk = (chunk * (length // distance + 1))[:length]
    unpacked += chunk
    return begin + 2 + long
