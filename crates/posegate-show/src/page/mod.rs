//! A site as one page for a browser: its plan, its tasks' success sets, tables and chains, and its tags. The page
//! contains the core as WebAssembly, which decides on an estimate that the reader drags.
//!
//! The page is one file. It fetches nothing (its own policy forbids it), and follows the reader's choice of light or
//! dark. Without WebAssembly it reports that, and still shows its pictures and numbers.
//!
//! `core.wasm` is the C boundary (`posegate-c`) compiled for `wasm32-unknown-unknown`. `./ci.sh wasm_bytes` builds it
//! again and compares the bytes. It has no imports, which shows that no panic is reachable in it. `./ci.sh browser`
//! runs the committed vector file through it in a browser.
//!
//! ```
//! use posegate_show::page::{Contents, PageInput, page};
//! use posegate_site::Site;
//! # const SITE: &str = include_str!("../../../../examples/sites/paper-chain.toml");
//!
//! let site = Site::parse(SITE, "paper-chain.toml")?;
//! let input = PageInput {
//!     site: &site,
//!     file: "paper-chain.toml".into(),
//!     title: "Hall 3".into(),
//!     placements: Vec::new(),
//!     pictures: Vec::new(),
//! };
//! // Builds and proves every table, and evaluates every chain.
//! let contents = Contents::of(&site, &|_| ())?;
//! let html = page(&input, &contents)?;
//! assert!(html.contains("<title>Hall 3"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub use self::contents::{Contents, PageError, PageInput, Shown, ShownChain};
pub use self::html::page;

mod contents;
mod equal_tasks;
mod figures;
mod html;
mod start;
mod summary;

/// The core as WebAssembly.
pub const CORE: &[u8] = include_bytes!("core.wasm");
