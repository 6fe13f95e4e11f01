#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| brdfit_fuzz::oracles::reading(bytes));
