//! The panic handler of the archive, which cannot be linked.

unsafe extern "C" {
    /// Not defined anywhere. A linker that reports it as missing has kept this handler: a debug build reaches it, and a release
    /// build that is linked without `--gc-sections` has it although nothing calls it. An archive of `--profile firmware` does not contain
    /// it, unless the crate is broken.
    fn posegate_a_panic_is_reachable() -> !;
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    // SAFETY: never linked.
    unsafe { posegate_a_panic_is_reachable() }
}
