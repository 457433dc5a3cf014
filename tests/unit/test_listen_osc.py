import struct

import pytest
from touchd.listen.osc import Malformed, OscBundle, OscMessage, decode

HEAD = b"#bundle\0" + struct.pack(">Q", 1)


def element(data: bytes) -> bytes:
    return struct.pack(">i", len(data)) + data


MESSAGE = b"/a\0\0,i\0\0" + struct.pack(">i", 7)


def test_a_message_in_no_bundle_has_no_time_tag() -> None:
    assert decode(MESSAGE) == (OscBundle(None, (OscMessage("/a", "i", (7,)),)),)


def test_a_nested_bundle_comes_after_the_one_that_holds_it() -> None:
    inner = b"#bundle\0" + struct.pack(">Q", 5) + element(MESSAGE)
    outer = HEAD + element(inner) + element(MESSAGE)
    message = OscMessage("/a", "i", (7,))
    assert decode(outer) == (OscBundle(1, (message,)), OscBundle(5, (message,)))


def test_every_type_of_the_specification_is_read() -> None:
    tags = b",ifsbhtdScrmTFNI[]\0\0"
    data = struct.pack(">if", -1, 0.5) + b"ab\0\0" + struct.pack(">i", 3) + b"xyz\0"
    data += struct.pack(">qQd", -2, 3, 0.25) + b"S\0\0\0" + struct.pack(">III", 65, 1, 2)
    decoded = decode(b"/a\0\0" + tags + data)
    assert not isinstance(decoded, Malformed)
    values = (-1, 0.5, "ab", b"xyz", -2, 3, 0.25, "S", 65, 1, 2)
    assert decoded[0].messages[0].arguments == values + (None,) * 6


@pytest.mark.parametrize(
    ("datagram", "offset", "problem"),
    [
        (b"", 0, "there is nothing where a bundle or a message should begin"),
        (b"abc", 3, "3 bytes are no multiple of 4"),
        (b"#bundle\0\0\0\0\0", 12, "the bundle ends before its time tag does"),
        (HEAD + struct.pack(">i", 8), 16, "the element's size is 8, but only 0 bytes are left"),
        (HEAD + struct.pack(">i", 0), 16, "the element's size is 0, which is no positive multiple of 4"),
        (HEAD + struct.pack(">i", -4), 16, "the element's size is -4, which is no positive multiple of 4"),
        (HEAD + element(b"#bund\0\0\0"), 20, "a bundle was expected"),
        (b"abcd", 0, 'found b\'abcd\' where "#bundle" or an address with its "/" should begin'),
        (b"/abc", 0, "the address has no zero byte at its end"),
        (b"/a\0x,\0\0\0", 2, "the address is not padded with zero bytes to a multiple of 4"),
        (b"/\xe4\0\0,\0\0\0", 1, "the address has the byte 0xe4, which is no printable ASCII"),
        (b"/a\0\0", 4, "the message has no type tags"),
        (b"/a\0\0i\0\0\0", 4, "the type tags begin with b'i' in place of \",\""),
        (b"/a\0\0,i\0\0", 8, "the arguments end before the type tags ',i' do"),
        (b"/a\0\0,x\0\0", 8, "the type tags ',x' have the unknown letter 'x'"),
        (MESSAGE + b"\0\0\0\0", 12, "4 bytes follow the last argument of the type tags ',i'"),
        (b"/a\0\0,s\0\0abcd", 8, "the string has no zero byte at its end"),
        (b"/a\0\0,b\0\0", 8, "the blob has no size"),
        (b"/a\0\0,b\0\0\0\0\0\x05", 8, "the blob's size is 5, but only 0 bytes are left"),
    ],
)
def test_what_is_malformed_is_told_with_its_byte(datagram: bytes, offset: int, problem: str) -> None:
    assert decode(datagram) == Malformed(offset, problem)


def test_bundles_without_end_are_told_too() -> None:
    deep = HEAD
    for _ in range(8):
        deep = HEAD + element(deep)
    assert decode(deep) == Malformed(160, "bundles are nested more than 8 deep")
