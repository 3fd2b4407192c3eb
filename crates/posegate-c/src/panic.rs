//! The panic handler of the archive: it cannot be linked.

unsafe extern "C" {
    /// Defined nowhere. A linker that asks for it has found a panic that the optimiser could not rule
    /// out: the archive was not built with `--profile firmware`, or the crate is broken.
    fn posegate_a_panic_is_reachable() -> !;
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    // SAFETY: never linked.
    unsafe { posegate_a_panic_is_reachable() }
}
