//! `spts_tests::parsers::profile`.
#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| spts_tests::parsers::profile(bytes));
