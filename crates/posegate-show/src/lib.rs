//! What a person looks at: pictures, mounting sheets, the page of a site, and what is wrong with a site.
#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod draw;

pub mod doctor;

pub mod page;
