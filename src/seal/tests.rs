use super::*;

/// Returns an ELF file of segments: load address, bytes, and number of file bytes between it and
/// the next.
fn elf(segments: &[(u32, &[u8], usize)]) -> Vec<u8> {
    let mut file = Vec::new();
    file.extend(*b"\x7fELF\x01\x01\x01\0\0\0\0\0\0\0\0\0");
    let half = |file: &mut Vec<u8>, value: u16| file.extend(value.to_le_bytes());
    let word = |file: &mut Vec<u8>, value: u32| file.extend(value.to_le_bytes());
    half(&mut file, 2);
    half(&mut file, 40);
    for value in [1, 0, 52, 0, 0] {
        word(&mut file, value);
    }
    for value in [52, 32, segments.len() as u16, 40, 0, 0] {
        half(&mut file, value);
    }
    let mut offset = 52 + 32 * segments.len();
    for (address, bytes, after) in segments {
        let length = bytes.len() as u32;
        for value in [1, offset as u32, *address, *address, length, length, 5, 4] {
            word(&mut file, value);
        }
        offset += bytes.len() + after;
    }
    for (_, bytes, after) in segments {
        file.extend(*bytes);
        file.extend(std::vec![0xee; *after]);
    }
    file
}

/// Returns an unsealed record among other bytes.
fn with_record(before: usize, after: usize) -> Vec<u8> {
    let mut bytes: Vec<u8> = (0..before).map(|v| v as u8).collect();
    bytes.extend(Seal::MAGIC);
    bytes.extend([0xff; 12]);
    bytes.extend((0..after).map(|v| (v * 7) as u8));
    bytes
}

#[test]
fn sealed_image_differs_only_in_its_checksum() {
    for (before, after) in [(0, 0), (4, 1), (400, 3), (8, 1000)] {
        let image = with_record(before, after);
        let file = elf(&[(0x0800_0000, &[1, 2, 3, 4], 0), (0x0800_0004, &image, 5)]);
        let sealed = seal(&file).unwrap();
        assert_eq!(checksum(&sealed.image), Seal::SUM);
        assert_eq!(sealed.start, 0x0800_0000);
        assert_eq!(sealed.image.len(), 4 + image.len());
        let at = 4 + before;
        assert_eq!(sealed.image[at + 8..at + 12], [0, 0, 0, 8]);
        assert_eq!(
            sealed.image[..at + 8],
            [&[1, 2, 3, 4], &image[..before + 8]].concat()
        );
        assert_eq!(sealed.image[at + 20..], image[before + 20..]);
        assert_eq!(sealed.file.len(), file.len());
        // Sealing again changes nothing. A sealed record elsewhere would belong to another
        // firmware.
        assert_eq!(seal(&sealed.file).unwrap().file, sealed.file);
    }
}

#[test]
fn linker_gap_is_filled_and_larger_gap_is_refused() {
    // The record in the second segment, and in the first, which is then loaded from a copy.
    let image = with_record(12, 0);
    for (first, second) in [(&image[..], &[9; 10][..]), (&[9; 10], &image)] {
        let end = first.len() as u32;
        let file = elf(&[(0, first, 0), (end + 6, second, 0)]);
        let sealed = seal(&file).unwrap();
        let length = sealed.image.len();
        assert_eq!(length, first.len() + 6 + second.len());
        assert_eq!(checksum(&sealed.image), Seal::SUM);
        assert_eq!(sealed.image[first.len()..first.len() + 6], [0; 6]);
        // A tool that uses segments, and one that uses sections and fills with zeros.
        let loaded = parts(&sealed.file).unwrap();
        assert_eq!(loaded[0].bytes.len(), first.len() + 6);
        assert_eq!(loaded[0].bytes.start % 4096, 0);
        let whole = |ranges: [Range<usize>; 2]| ranges.map(|r| sealed.file[r].to_vec()).concat();
        assert_eq!(whole([0, 1].map(|k| loaded[k].bytes.clone())), sealed.image);
        let original = parts(&file).unwrap();
        assert_eq!(
            sealed.file[original[0].bytes.clone()],
            sealed.image[..first.len()]
        );
        assert_eq!(seal(&sealed.file).unwrap().file, sealed.file);
    }
    let file = elf(&[(0, &[9; 10], 2), (5000, &image, 0)]);
    assert_eq!(seal(&file).unwrap_err(), SealError::Gap(10, 5000));
    let file = elf(&[(0, &[9; 10], 2), (9, &image, 0)]);
    assert_eq!(seal(&file).unwrap_err(), SealError::Overlap(9));
}

#[test]
fn unsealable_image_is_refused_with_reason() {
    let no_elf = |file: &[u8]| matches!(seal(file), Err(SealError::NotElf(_)));
    assert!(no_elf(&[]) && no_elf(b"POSEGATE") && no_elf(&[0; 200]));
    assert_eq!(seal(&elf(&[])).unwrap_err(), SealError::Empty);
    assert_eq!(
        seal(&elf(&[(0, &[1; 40], 0)])).unwrap_err(),
        SealError::NoRecord
    );
    let mut twice = with_record(0, 0);
    twice.extend(with_record(0, 0));
    assert_eq!(
        seal(&elf(&[(0, &twice, 0)])).unwrap_err(),
        SealError::ManyRecords(2)
    );
    let image = with_record(0, 100);
    let whole = elf(&[(0, &image, 0)]);
    for length in 0..whole.len() {
        assert!(no_elf(&whole[..length]), "{length}");
    }
    let high = elf(&[(u32::MAX - 8, &image, 0)]);
    assert!(no_elf(&high));
}

/// The controller checks every bit that the tool seals.
#[test]
fn controller_detects_every_flipped_bit_of_sealed_image() {
    let image = with_record(20, 40);
    let mut sealed = seal(&elf(&[(0, &image, 0)])).unwrap().image;
    for bit in 0..sealed.len() * 8 {
        sealed[bit / 8] ^= 1 << (bit % 8);
        assert_ne!(checksum(&sealed), Seal::SUM);
        sealed[bit / 8] ^= 1 << (bit % 8);
    }
    assert_eq!(checksum(&sealed), Seal::SUM);
}
