//! Another method while a stream runs.

use super::*;

/// The pictures of a stream that changes from one method to another at its third key.
fn shown_after_change(from: Method, to: Method) -> Vec<Vec<u8>> {
    let mut engine = engine(from);
    let mut shown = Vec::new();
    for key in 0..6_i64 {
        if key == 2 {
            engine.set_method(to, None);
        }
        push(&mut engine, 100 + 25 * key, u8::try_from(11 * key).unwrap()).unwrap();
        for later in [-10, 0, 8, 16] {
            shown.push(frame(&mut engine, 100 + 25 * key + later));
        }
    }
    shown
}

#[test]
fn a_change_of_method_between_any_two_shows_what_the_new_one_shows_two_keys_later() {
    for to in Method::ALL.iter().copied() {
        let always = shown_after_change(to, to);
        for from in Method::ALL.iter().copied().filter(|from| *from != to) {
            let changed = shown_after_change(from, to);
            // Methods that judge or accelerate have two keys behind them by then.
            assert_eq!(changed[20..], always[20..], "{from} to {to}");
            if !matches!(to, Method::Affine | Method::Quadratic | Method::World | Method::Auto) {
                assert_eq!(changed[8..], always[8..], "{from} to {to}");
            }
        }
    }
}

#[test]
fn a_change_of_method_shows_in_the_very_next_picture() {
    let mut engine = engine(Method::Hold);
    push(&mut engine, 100, 0).unwrap();
    let held = frame(&mut engine, 125);
    engine.set_method(Method::Gather, None);
    assert_ne!(frame(&mut engine, 125), held);
    engine.set_method(Method::Hold, None);
    assert_eq!(frame(&mut engine, 125), held);
}
