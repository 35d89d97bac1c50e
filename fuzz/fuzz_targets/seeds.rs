//! `spts_tests::parsers::seeds`.
#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| spts_tests::parsers::seeds(bytes));
