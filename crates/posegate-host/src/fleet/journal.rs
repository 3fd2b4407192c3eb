//! For tests: what was done to names, in order, on this thread, and what goes wrong in the middle of it.

use std::cell::RefCell;
use std::io;
use std::path::{Path, PathBuf};

/// What goes wrong.
#[derive(Clone, Copy, Debug)]
pub(super) enum InjectedFault {
    /// A disk that fails once.
    Fails,
    /// The process is killed: nothing is done from there on.
    Killed,
}

/// What was done, and to what.
pub(super) type Step = (&'static str, PathBuf);

struct Journal {
    steps: Vec<Step>,
    fault: Option<(usize, InjectedFault)>,
}

std::thread_local! {
    static JOURNAL: RefCell<Option<Journal>> = const { RefCell::new(None) };
}

/// Begins a journal, with what goes wrong in place of the step of a number, counted from 0.
pub(super) fn begin(fault: Option<(usize, InjectedFault)>) {
    let steps = Vec::new();
    JOURNAL.set(Some(Journal { steps, fault }));
}

/// The steps; none are counted from here on.
pub(super) fn end() -> Vec<Step> {
    JOURNAL
        .take()
        .map(|journal| journal.steps)
        .unwrap_or_default()
}

/// A step that is to be done.
pub(super) fn step(what: &'static str, path: &Path) -> io::Result<()> {
    let fault = JOURNAL.with_borrow_mut(|journal| {
        let journal = journal.as_mut()?;
        let number = journal.steps.len();
        journal.steps.push((what, path.into()));
        journal.fault.filter(|(at, _)| *at == number)
    });
    match fault {
        None => Ok(()),
        Some((_, InjectedFault::Fails)) => Err(io::Error::other(format!("{what} fails"))),
        // Quietly: it is no fault of this program.
        Some((_, InjectedFault::Killed)) => {
            std::panic::resume_unwind(std::boxed::Box::new("killed"))
        }
    }
}
