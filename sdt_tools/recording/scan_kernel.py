"""Scans out of an unpacked chunk without an object for each: records and protobuf fields walked by compiled code."""

from typing import no_type_check

import numpy as np
from numba import njit


@njit(cache=True)
@no_type_check
def find_messages(buffer, channel_ids):
    """Messages of ``channel_ids`` among the records of ``buffer``: log and publish times, start and end of their data.

    ``buffer`` is bytes as uint8. Stops at a record that is cut off.
    """
    capacity = buffer.size // 31 + 1  # head and fixed part of a message record
    log_ns = np.empty(capacity, np.int64)
    publish_ns = np.empty(capacity, np.int64)
    starts = np.empty(capacity, np.int64)
    ends = np.empty(capacity, np.int64)
    found = 0
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
                    log_ns[found] = _little(buffer, at + 6, 8)
                    publish_ns[found] = _little(buffer, at + 14, 8)
                    starts[found] = at + 22
                    ends[found] = at + length
                    found += 1
                    break
        at += length
    return log_ns[:found], publish_ns[:found], starts[:found], ends[:found]


@njit(cache=True)
@no_type_check
def find_ranges(buffer, starts, ends):
    """Where the ranges of each foxglove.LaserScan lie: offset and byte length.

    An offset of -1 marks a message in an unusual layout, which protobuf must parse.
    """
    offsets = np.full(starts.size, -1, np.int64)
    lengths = np.zeros(starts.size, np.int64)
    for row in range(starts.size):
        at, end = starts[row], ends[row]
        offset, size = 0, 0
        while at < end:
            tag = buffer[at]
            at += 1
            if tag == 0x21 or tag == 0x29:  # start_angle, end_angle: doubles
                at += 8
                continue
            if tag & 0x87 != 2:  # anything else but a length-delimited field of number 1 to 15
                offset = -1
                break
            length, shift, group = np.int64(0), 0, np.int64(0x80)
            while group >= 0x80 and at < end and shift < 35:
                group = np.int64(buffer[at])
                at += 1
                length |= (group & 0x7F) << shift
                shift += 7
            if group >= 0x80 or length > end - at:
                offset = -1
                break
            if tag == 0x32:  # ranges, packed
                if offset > 0 or length % 8 != 0:
                    offset = -1
                    break
                offset, size = at, length
            at += length
        if at == end and offset >= 0:
            offsets[row] = offset
            lengths[row] = size
    return offsets, lengths


@njit(cache=True)
@no_type_check
def copy_rows(buffer, offsets, rows):
    """Copy ``rows.shape[1]`` bytes from each offset ≥ 0 of ``buffer`` into the rows; others are left alone."""
    width = rows.shape[1]
    for row in range(offsets.size):
        at = offsets[row]
        if at >= 0:
            for place in range(width):  # compiled to wide moves; a slice assignment is not
                rows[row, place] = buffer[at + place]


@njit(cache=True)
@no_type_check
def _little(buffer, at, size):
    value = np.int64(0)
    for place in range(size):
        value |= np.int64(buffer[at + place]) << (8 * place)
    return value
