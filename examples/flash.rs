//! A controller that only decides: `ci.sh flash` measures its size.
//!
//! ```text
//! cargo build -p posegate --profile firmware --target thumbv7em-none-eabihf --features firmware --example flash
//! ```
#![cfg_attr(target_os = "none", no_std, no_main)]

/// Firmware has no meaning on a host; this lets `cargo test --all-features` build there.
#[cfg(not(target_os = "none"))]
fn main() {}

#[cfg(target_os = "none")]
mod firmware {
    use core::hint::black_box;
    use core::panic::PanicInfo;
    use cortex_m_rt::entry;
    use posegate::contain::decide;
    use posegate::set::{Estimate, PoseSet};
    use posegate::table::Table;

    static TABLE: &[u8] = include_bytes!("tables/see-t7.posegate");

    #[panic_handler]
    fn panic(_: &PanicInfo<'_>) -> ! {
        idle()
    }

    #[entry]
    fn main() -> ! {
        let estimate = Estimate {
            x_m: black_box(0.0),
            y_m: black_box(0.0),
            yaw_rad: black_box(0.0),
        };
        let set = PoseSet::bounded(estimate, black_box(0.1), black_box(0.1));
        if let (Ok(table), Ok(set)) = (Table::parse(black_box(TABLE)), set) {
            let _ = black_box(decide(black_box(&table), black_box(&set)));
        }
        idle()
    }

    fn idle() -> ! {
        loop {
            core::hint::spin_loop();
        }
    }
}
