"""Scans out of an unpacked chunk without an object for each: records and protobuf fields walked by compiled code."""

from typing import no_type_check

import numpy as np
from numba import njit

LOG_NS, PUBLISH_NS, START, END, OFFSET, LENGTH = range(6)
"""Columns of what ``find_scans`` finds."""


@njit(cache=True)
@no_type_check
def find_scans(buffer, channel_ids, row_bytes):
    """Messages of ``channel_ids`` among the records of ``buffer``, a row each, and whether all are as usual.

    ``buffer`` is bytes as uint8. The columns are log and publish time (negative beyond 63 bits), start and end of the
    message's data, and offset and byte length of its ranges as ``find_ranges`` has them. As usual means in the order
    of their log times, none of them negative, each with ``row_bytes`` of ranges. Stops at a record that is cut off.
    """
    found = np.empty((_walk(buffer, channel_ids, np.empty((0, 6), np.int64)), 6), np.int64)
    _walk(buffer, channel_ids, found)
    usual, last_ns = True, np.int64(0)
    for row in range(len(found)):
        found[row, OFFSET], found[row, LENGTH] = find_ranges(buffer, found[row, START], found[row, END])
        if found[row, LOG_NS] < last_ns or found[row, PUBLISH_NS] < 0 or found[row, LENGTH] != row_bytes:
            usual = False
        last_ns = found[row, LOG_NS]
    return found, usual


@njit(cache=True)
@no_type_check
def _walk(buffer, channel_ids, found):
    """How many messages there are; as many as ``found`` has rows get their first four columns filled."""
    rows = 0
    at = 0
    while at + 9 <= buffer.size:
        opcode = buffer[at]
        length = _little(buffer, at + 1, 8)
        at += 9
        if length < 0 or length > buffer.size - at:
            break
        if opcode == 5 and length >= 22:
            channel_id = _little(buffer, at, 2)
            for wanted in channel_ids:
                if channel_id == wanted:
                    if rows < len(found):
                        found[rows, LOG_NS] = _little(buffer, at + 6, 8)
                        found[rows, PUBLISH_NS] = _little(buffer, at + 14, 8)
                        found[rows, START] = at + 22
                        found[rows, END] = at + length
                    rows += 1
                    break
        at += length
    return rows


@njit(cache=True)
@no_type_check
def find_ranges(buffer, start, end):
    """Where the ranges of the foxglove.LaserScan in ``buffer[start:end]`` lie: offset and byte length.

    An offset of -1, with a length of 0, marks an unusual layout, which protobuf must parse.
    """
    at = np.int64(start)
    offset, size = np.int64(0), np.int64(0)
    while at < end:
        tag = buffer[at]
        at += 1
        if tag == 0x21 or tag == 0x29:  # start_angle, end_angle: doubles
            at += 8
            continue
        if tag & 0x87 != 2:  # anything else but a length-delimited field of number 1 to 15
            return np.int64(-1), np.int64(0)
        length, shift, group = np.int64(0), 0, np.int64(0x80)
        while group >= 0x80 and at < end and shift < 35:
            group = np.int64(buffer[at])
            at += 1
            length |= (group & 0x7F) << shift
            shift += 7
        if group >= 0x80 or length > end - at:
            return np.int64(-1), np.int64(0)
        if tag == 0x32:  # ranges, packed
            if offset > 0 or length % 8 != 0:
                return np.int64(-1), np.int64(0)
            offset, size = at, length
        at += length
    return (offset, size) if at == end else (np.int64(-1), np.int64(0))


@njit(cache=True)
@no_type_check
def copy_scans(buffer, found, first, count, stamps_ns, received_ns, ranges, row):
    """Copy ``count`` rows of ``found`` from ``first`` on into the three series from ``row`` on.

    ``ranges`` are rows of bytes; those of scans with an offset of -1 are left alone.
    """
    width = ranges.shape[1]
    for number in range(count):
        scan = first + number
        stamps_ns[row + number] = found[scan, PUBLISH_NS]
        received_ns[row + number] = found[scan, LOG_NS]
        at = found[scan, OFFSET]
        if at >= 0:
            for place in range(width):  # compiled to wide moves; a slice assignment is not
                ranges[row + number, place] = buffer[at + place]


@njit(cache=True)
@no_type_check
def _little(buffer, at, size):
    value = np.int64(0)
    for place in range(size):
        value |= np.int64(buffer[at + place]) << (8 * place)
    return value
