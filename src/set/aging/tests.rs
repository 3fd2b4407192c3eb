use super::*;
use proptest::prelude::*;
use std::vec::Vec;

fn factor(q16: u32) -> Inflation {
    Inflation::from_q16(q16).expect("a factor")
}

/// The definition: the factor that was given for an age, in exact numbers.
fn given(steps: &[(u32, Inflation)], since_fix_ms: u32, inflation: Inflation) -> Inflation {
    let covers = |step: &&(u32, Inflation)| since_fix_ms <= step.0;
    steps.iter().find(covers).map_or(inflation, |step| step.1)
}

/// All tables of up to two steps on small ages and factors, at every age around their steps.
#[test]
fn small_tables_are_never_below_what_was_given() {
    let ages = [64, 65, 127, 128, 129, 191, 192, 1000];
    let factors = [
        1 << 16,
        (1 << 16) + 1,
        66_559,
        66_560,
        66_561,
        3 << 16,
        5 << 16,
    ];
    let largest = factor(5 << 16);
    let mut tried = 0;
    let mut check = |steps: &[(u32, Inflation)]| {
        let Some(aging) = Aging::new(steps) else {
            return;
        };
        tried += 1;
        assert!(aging.is_valid() && aging.is_within(largest));
        let mut before = Inflation::NONE;
        for age in (0..1200).chain([4_194_240, u32::MAX - 63, u32::MAX]) {
            let used = aging.at(age, largest);
            assert_eq!(used, aging.at_from_oldest(age, largest), "{age} {steps:?}");
            assert!(
                used >= given(steps, age, largest),
                "{age} {steps:?} {used:?}"
            );
            assert!(used >= before, "{age} {steps:?}");
            before = used;
        }
    };
    check(&[]);
    for (a, f) in ages
        .iter()
        .flat_map(|a| factors.iter().map(move |f| (*a, factor(*f))))
    {
        check(&[(a, f)]);
        for (b, g) in ages
            .iter()
            .flat_map(|a| factors.iter().map(move |f| (*a, factor(*f))))
        {
            check(&[(a, f), (b, g)]);
        }
    }
    assert!(tried > 700, "{tried} tables");
}

#[test]
fn steps_that_are_no_table_are_refused() {
    let two = factor(2 << 16);
    let one = Inflation::NONE;
    for steps in [
        &[(63, one)][..],
        &[(1 << 22, one)],
        &[(1000, two), (2000, one)],
        &[(1000, one), (1010, two)],
        &[(1000, factor(1 << 26))],
        &[(100, one), (200, one), (300, one), (400, one), (500, one)],
    ] {
        assert_eq!(Aging::new(steps), None, "{steps:?}");
    }
    let table = Aging::new(&[(1000, one), (2000, two)]).expect("a table");
    assert!(!table.is_within(factor((2 << 16) - 1)) && table.is_within(two));
    assert_eq!(Aging::from_words(table.words()), Some(table));
    // A gap, a factor below 1, a fall.
    let [a, b, _, _] = table.words();
    for words in [
        [0, a, b, 0],
        [a & 0xffff, b, 0, 0],
        [b, a, 0, 0],
        [a, a, 0, 0],
    ] {
        assert_eq!(Aging::from_words(words), None, "{words:?}");
    }
}

proptest! {
    #[test]
    fn factor_is_never_below_what_was_given(
        raw in proptest::collection::vec((64u32..1 << 22, 1u32 << 16..1 << 25), 0..=MOST_AGES),
        more in 0u32..1 << 25,
        ages in proptest::collection::vec(any::<u32>(), 16),
    ) {
        let mut steps: Vec<(u32, Inflation)> = raw.iter().map(|(age, q16)| (*age, factor(*q16))).collect();
        steps.sort_unstable();
        let mut most = Inflation::NONE;
        for step in &mut steps {
            most = most.max(step.1);
            step.1 = most;
        }
        // Slack for the rounding of the last factor.
        let largest = factor(most.q16() + 1024 + more);
        if let Some(aging) = Aging::new(&steps) {
            prop_assert!(aging.is_within(largest));
            let near = steps.iter().flat_map(|(age, _)| [age - 1, *age, age + 1, age & !63]);
            for age in ages.iter().map(|age| age >> 8).chain(ages.iter().copied()).chain(near) {
                let used = aging.at(age, largest);
                prop_assert_eq!(used, aging.at_from_oldest(age, largest));
                prop_assert!(used >= given(&steps, age, largest));
                prop_assert!(used <= largest);
            }
        }
    }

    /// Any words, as a fault in memory leaves them: a factor of the table or the source's, without a panic.
    #[test]
    fn any_words_have_a_factor(words in any::<[u32; MOST_AGES]>(), age: u32) {
        let aging = Aging::of(words);
        let largest = factor(4 << 16);
        for used in [aging.at(age, largest), aging.at_from_oldest(age, largest)] {
            prop_assert!(Inflation::from_q16(used.q16()).is_some());
        }
        let _ = (aging.is_valid(), aging.is_within(largest));
    }

    /// After a flipped bit of words or digest the source's own inflation applies.
    #[test]
    fn a_flipped_bit_leaves_no_smaller_factor(
        ages in proptest::array::uniform4(1u32..2000), bit in 0u32..160, age in 0u32..600_000,
    ) {
        let mut steps: Vec<(u32, Inflation)> = ages.iter().map(|age| (age << 6, Inflation::NONE)).collect();
        steps.sort_unstable();
        if let Some(mut aging) = Aging::new(&steps) {
            match aging.words.get_mut(bit as usize / 32) {
                Some(word) => *word ^= 1 << (bit % 32),
                None => aging.digest ^= 1 << (bit % 32),
            }
            let largest = factor(4 << 16);
            prop_assert!(!aging.is_valid());
            prop_assert_eq!(aging.at(age, largest), largest);
            prop_assert_eq!(aging.at_from_oldest(age, largest), largest);
        }
    }
}
