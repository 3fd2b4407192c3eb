//! A firmware under test: its sealed file and the addresses of its parts.

use crate::machine::SHOWN_AGAIN;
use object::{Object, ObjectSymbol};
use std::path::{Path, PathBuf};

pub struct Firmware {
    pub name: &'static str,
    /// The file as the linker left it.
    pub built: PathBuf,
    /// The file that is run.
    pub file: PathBuf,
    /// A file with the erased flash above the image.
    erased: PathBuf,
    /// The bytes that are loaded into flash, from address 0 on.
    pub image: Vec<u8>,
    pub begins: u32,
    pub done: u32,
    /// Marker that is reached in the requested cycle.
    pub stop: u32,
    pub over: u32,
    pub halted: u32,
    /// Address of an instruction that stores r1 at the address in r0.
    pub store: u32,
    /// Addresses of the variables: from, to.
    pub variables: (u32, u32),
    /// Address just above the stack.
    pub stack_top: u32,
    markers_end: u32,
    /// Functions by address, for reports of faults.
    functions: Vec<(u32, String)>,
    _directory: tempfile::TempDir,
}

impl Firmware {
    /// Builds an example and, if it has a record for it, seals it. `table` is the one of the schedule, if not the dock's.
    pub fn build(name: &'static str, seals: bool, table: Option<&str>) -> Self {
        let table = table.map(|table| ("POSEGATE_FAULT_TABLE", table));
        let built = crate::support::build_in(name, "firmware", table.as_slice());
        let bytes = std::fs::read(&built).expect("the firmware");
        let directory = tempfile::tempdir().expect("a directory for the firmware");
        let file = directory.path().join(name);
        let (bytes, image) = if seals {
            let sealed = posegate::seal::seal(&bytes)
                .unwrap_or_else(|error| panic!("{}: {error}; {}", built.display(), error.help()));
            assert_eq!(sealed.start, 0);
            (sealed.file, sealed.image)
        } else {
            let image = loaded(&bytes);
            (bytes, image)
        };
        std::fs::write(&file, &bytes).expect("a place for the firmware");
        // Unused flash is erased, which is not a valid instruction. The emulator would have zeros there.
        let rest = SHOWN_AGAIN as usize - image.len();
        let erased = directory.path().join("erased");
        std::fs::write(&erased, vec![0xff; rest]).expect("a place for erased flash");
        let elf = object::File::parse(&*bytes).expect("an ELF file");
        let address = |name: &str| {
            elf.symbols()
                .find(|symbol| symbol.name() == Ok(name))
                .unwrap_or_else(|| panic!("no symbol {name} in {}", built.display()))
                .address() as u32
        };
        // The lowest bit of a function's address marks Thumb code.
        let code = |name: &str| address(name) & !1;
        let mut functions: Vec<(u32, String)> = elf
            .symbols()
            .filter(|symbol| symbol.kind() == object::SymbolKind::Text)
            .filter_map(|symbol| {
                let name = symbol.name().ok()?;
                let address = symbol.address() as u32 & !1;
                Some((address, name.to_owned()))
            })
            .collect();
        functions.sort();
        Self {
            name,
            begins: code("cycle_begins"),
            done: code("cycle_done"),
            stop: code("stop"),
            markers_end: code("markers_end"),
            over: code("schedule_over"),
            halted: code("halted"),
            store: code("store"),
            variables: (address("__sdata"), address("__ebss")),
            stack_top: address("_stack_start"),
            built,
            file,
            erased,
            image,
            functions,
            _directory: directory,
        }
    }

    /// Returns the emulator's argument that loads erased flash above the image.
    pub fn erased(&self) -> String {
        let place = self.image.len();
        let file = self.erased.display();
        format!("loader,file={file},addr={place:#x},force-raw=on")
    }

    /// Returns the addresses at which the firmware stops for the harness.
    pub fn stops(&self) -> [u32; 3] {
        [self.stop, self.over, self.halted]
    }

    /// Returns `true` if an address is in the markers, which no product has.
    pub fn is_in_marker(&self, address: u32) -> bool {
        (self.begins..self.markers_end).contains(&address)
    }

    /// Writes a file of the image with one bit flipped, for a boot with a damaged image.
    pub fn damaged(&self, address: u32, bit: u8, to: &Path) -> PathBuf {
        let mut image = self.image.clone();
        image[address as usize] ^= 1 << bit;
        let file = to.join("damaged.bin");
        std::fs::write(&file, image).expect("a place for the damaged firmware");
        file
    }

    /// Returns the function that contains an address.
    pub fn function(&self, address: u32) -> String {
        let after = self.functions.partition_point(|(at, _)| *at <= address);
        let Some((start, name)) = after.checked_sub(1).and_then(|k| self.functions.get(k)) else {
            return "?".into();
        };
        format!("{name}+{:#x}", address - start)
    }
}

/// Returns the bytes that an ELF file loads into flash, from address 0 on.
fn loaded(bytes: &[u8]) -> Vec<u8> {
    use object::{ObjectSegment, SegmentFlags};
    let elf = object::File::parse(bytes).expect("an ELF file");
    let mut image = Vec::new();
    for segment in elf.segments() {
        let data = segment.data().expect("a segment's bytes");
        if data.is_empty() || segment.address() >= 0x2000_0000 {
            continue;
        }
        debug_assert!(matches!(segment.flags(), SegmentFlags::Elf { .. }));
        let start = segment.address() as usize;
        if image.len() < start + data.len() {
            image.resize(start + data.len(), 0);
        }
        image[start..start + data.len()].copy_from_slice(data);
    }
    image
}
