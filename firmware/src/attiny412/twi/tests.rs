//! The client, event by event.

use super::*;

fn client() -> Twi {
    let mut twi = Twi::default();
    twi.write(SADDR, 40 << 1).unwrap();
    twi.write(SCTRLA, ENABLE | PIEN | APIEN | DIEN).unwrap();
    twi
}

#[test]
fn a_write_is_held_until_the_program_answers() {
    let mut twi = client();
    assert!(!twi.hear_address(41 << 1));
    assert!(twi.hear_address(40 << 1));
    assert_eq!(twi.read(SSTATUS), Some(APIF | CLKHOLD | AP));
    assert!(twi.requests() && twi.holds());
    twi.write(SCTRLB, RESPONSE).unwrap();
    assert!(twi.take_acknowledge() && !twi.holds() && !twi.requests());
    twi.hear_byte(0x5a);
    assert_eq!(twi.read(SSTATUS), Some(DIF | CLKHOLD | AP));
    assert_eq!(twi.read(SDATA), Some(0x5a));
    assert!(
        twi.holds(),
        "without smart mode a read of SDATA does not release the clock"
    );
    twi.write(SCTRLB, ACKACT | RESPONSE).unwrap();
    assert!(!twi.take_acknowledge() && !twi.holds());
    twi.hear_byte(1);
    assert_eq!(
        twi.read(SDATA),
        Some(0x5a),
        "a client that refused a byte is out until the next START"
    );
    twi.hear_stop(false);
    assert_eq!(twi.read(SSTATUS), Some(APIF));
    assert!(twi.requests() && !twi.holds());
    twi.write(SCTRLB, COMPTRANS).unwrap();
    assert_eq!(twi.read(SSTATUS), Some(0));
}

#[test]
fn a_read_sends_what_the_program_loads() {
    let mut twi = client();
    twi.hear_address(40 << 1 | 1);
    twi.write(SCTRLB, RESPONSE).unwrap();
    assert_eq!(twi.read(SSTATUS), Some(DIF | CLKHOLD | DIR | AP));
    twi.write(SDATA, 0x12).unwrap();
    assert!(twi.holds() && twi.take_acknowledge());
    twi.write(SCTRLB, RESPONSE).unwrap();
    assert!(twi.sends());
    assert_eq!(twi.byte_sent(), 0x12);
    twi.hear_answer(0x12, false);
    assert_eq!(twi.read(SSTATUS), Some(DIF | CLKHOLD | RXACK | DIR | AP));
    twi.write(SCTRLB, COMPTRANS).unwrap();
    assert!(!twi.holds());
    assert_eq!(twi.byte_sent(), 0xff);
}

#[test]
fn a_client_whose_byte_is_overruled_leaves_the_bus() {
    let mut twi = client();
    twi.hear_address(40 << 1 | 1);
    twi.write(SCTRLB, RESPONSE).unwrap();
    twi.write(SDATA, 0x81).unwrap();
    twi.write(SCTRLB, RESPONSE).unwrap();
    twi.hear_answer(0x01, true);
    assert_eq!(twi.read(SSTATUS), Some(DIF | COLL | DIR | AP));
    assert_eq!(twi.byte_sent(), 0xff);
}

#[test]
fn smart_mode_answers_by_the_data_register() {
    let mut twi = client();
    twi.write(SCTRLA, ENABLE | SMEN).unwrap();
    twi.hear_address(40 << 1);
    twi.write(SSTATUS, APIF).unwrap();
    assert!(twi.take_acknowledge());
    twi.hear_byte(7);
    assert_eq!(twi.read(SDATA), Some(7));
    assert!(twi.take_acknowledge() && !twi.holds());
    twi.hear_address(40 << 1 | 1);
    twi.write(SCTRLB, RESPONSE).unwrap();
    twi.write(SDATA, 3).unwrap();
    assert!(twi.sends());
}

#[test]
fn masks_second_addresses_general_calls_and_all_addresses() {
    let mut twi = client();
    twi.write(SADDRMASK, 3 << 1).unwrap();
    assert_eq!(
        (39..46).filter(|a| twi.hear_address(a << 1)).collect::<Vec<_>>(),
        [40, 41, 42, 43]
    );
    twi.write(SADDRMASK, 99 << 1 | ADDREN).unwrap();
    assert_eq!(
        (0..128).filter(|a| twi.hear_address(a << 1)).collect::<Vec<_>>(),
        [40, 99]
    );
    twi.write(SADDR, 40 << 1 | 1).unwrap();
    assert!(twi.hear_address(0) && !twi.hear_address(1));
    twi.write(SCTRLA, ENABLE | PMEN).unwrap();
    assert!(twi.hear_address(77 << 1));
    twi.write(SCTRLA, 0).unwrap();
    assert!(!twi.hear_address(40 << 1));
}

#[test]
fn every_stop_is_heard_and_an_illegal_one_is_an_error() {
    let mut twi = client();
    twi.hear_address(41 << 1);
    twi.hear_stop(true);
    assert_eq!(twi.read(SSTATUS), Some(APIF | BUSERR));
    twi.hear_address(40 << 1);
    assert_eq!(
        twi.read(SSTATUS),
        Some(APIF | BUSERR | CLKHOLD | AP),
        "the address overwrites the STOP"
    );
    twi.write(SSTATUS, BUSERR | APIF).unwrap();
    twi.hear_stop(false);
    twi.write(SSTATUS, APIF).unwrap();
    assert_eq!(twi.read(SSTATUS), Some(0));
}
