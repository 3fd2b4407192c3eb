//! Work on all cores, also in a forked process. Threads do not survive a fork, so the parent's pool would wait for them
//! forever.

use rayon::ThreadPoolBuilder;
use std::process;
use std::sync::OnceLock;

/// The process that has the threads of rayon's own pool.
static OWNER: OnceLock<u32> = OnceLock::new();

/// Runs work that may use all cores.
pub fn on_all_cores<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    if *OWNER.get_or_init(process::id) == process::id() {
        return work();
    }
    // A separate pool; without one, the work would wait forever.
    match ThreadPoolBuilder::new().build() {
        Ok(pool) => pool.install(work),
        Err(error) => panic!("no threads: {error}"),
    }
}
