use super::*;
use ruzstd::encoding::{CompressionLevel, compress_to_vec};
use std::io::Write;

fn zstd(content: &[u8]) -> Vec<u8> {
    compress_to_vec(content, CompressionLevel::Fastest)
}

fn lz4(content: &[u8]) -> Vec<u8> {
    let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
    encoder.write_all(content).unwrap();
    encoder.finish().unwrap()
}

fn content(length: usize) -> Vec<u8> {
    (0..length).map(|k| (k / 7 % 251) as u8).collect()
}

#[test]
fn frames_decompress_to_their_content() {
    for length in [0, 1, 1000, 200_000, 5_000_000] {
        let content = content(length);
        for (compression, data) in [
            (Compression::None, content.clone()),
            (Compression::Zstd, zstd(&content)),
            (Compression::Lz4, lz4(&content)),
        ] {
            let output = unpacked(compression, &data, length).unwrap();
            assert!(output == content, "{compression:?} {length}");
            let padded = [&data[..], b"padding"].concat();
            if compression != Compression::None {
                assert!(unpacked(compression, &padded, length).unwrap() == content);
            }
        }
    }
}

#[test]
fn content_of_several_frames_is_joined() {
    let mut skippable = (SKIPPABLE + 3).to_le_bytes().to_vec();
    skippable.extend([3, 0, 0, 0, 9, 9, 9]);
    let content = content(300_000);
    let (head, tail) = content.split_at(100_000);
    let zstd = [skippable.clone(), zstd(head), zstd(tail)].concat();
    let lz4 = [skippable, lz4(head), lz4(tail)].concat();
    assert!(unpacked(Compression::Zstd, &zstd, 300_000).unwrap() == content);
    assert!(unpacked(Compression::Lz4, &lz4, 300_000).unwrap() == content);
    let empty = self::zstd(b"").repeat(MOST_FRAMES as usize);
    let error = unpacked(Compression::Zstd, &empty, 1).unwrap_err();
    assert!(matches!(error, BadData::Frames), "{error}");
}

#[test]
fn content_of_another_size_than_stated_is_an_error() {
    let content = content(3_000_000);
    for (compression, data) in [
        (Compression::None, content.clone()),
        (Compression::Zstd, zstd(&content)),
        (Compression::Lz4, lz4(&content)),
    ] {
        for size in [1, 1000, 2_999_999] {
            let error = unpacked(compression, &data, size).unwrap_err();
            assert!(matches!(error, BadData::Long { .. }), "{error}");
        }
        let error = unpacked(compression, &data, 3_000_001).unwrap_err();
        assert!(matches!(error, BadData::Short { .. }), "{error}");
    }
}

#[test]
fn cut_or_flipped_frames_are_errors_or_have_the_stated_size() {
    let content = content(20_000);
    for (compression, data) in [
        (Compression::Zstd, zstd(&content)),
        (Compression::Lz4, lz4(&content)),
    ] {
        for cut in 0..data.len() {
            if let Ok(output) = unpacked(compression, &data[..cut], 20_000) {
                assert!(output == content, "{compression:?} {cut}");
            }
        }
        for bit in 0..8 * data.len() {
            let mut flipped = data.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            if let Ok(output) = unpacked(compression, &flipped, 20_000) {
                assert_eq!(output.len(), 20_000, "{compression:?} {bit}");
            }
        }
    }
}
