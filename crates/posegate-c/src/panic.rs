//! The panic handler of the archive, which cannot be linked.

unsafe extern "C" {
    /// Not defined anywhere. A linker that reports it as missing has found a panic that the optimiser
    /// could not rule out: the archive was not built with `--profile firmware`, or the crate is
    /// broken.
    fn posegate_a_panic_is_reachable() -> !;
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    // SAFETY: never linked.
    unsafe { posegate_a_panic_is_reachable() }
}
