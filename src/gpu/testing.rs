//! The device of tests: the software driver, whose pictures are the same on every machine, or a visible skip. Unit tests use it as
//! `crate::gpu::testing`, tests outside the library through `tests/common`, which includes this file.

use super::{AdapterChoice, Gpu};

/// Set, and not to 0, it turns a skip for want of a graphics adapter into a failure.
const REQUIRED: &str = "SPHEREBOARD_REQUIRE_GPU";

/// The software driver; `None`, said aloud, where it is not installed.
///
/// # Panics
/// Where it is not installed and `SPHEREBOARD_REQUIRE_GPU` is set.
pub fn software_gpu() -> Option<Gpu> {
    match Gpu::open(&AdapterChoice::Software) {
        Ok(gpu) => Some(gpu),
        Err(why) => {
            skip(&format!("no graphics adapter ({why}); install mesa-vulkan-drivers"));
            None
        }
    }
}

/// Says aloud why a test cannot run here.
///
/// # Panics
/// Where `SPHEREBOARD_REQUIRE_GPU` is set.
pub fn skip(why: &str) {
    let required = std::env::var_os(REQUIRED).is_some_and(|value| value != "0");
    assert!(!required, "{REQUIRED} is set, but there is {why}");
    eprintln!("SKIPPED: {why} (scripts/setup test installs what is missing)");
}
