//! Every error of the core has a readable message, and is a `core::error::Error`.

use std::collections::BTreeSet;
use std::error::Error;

use posegate::chain::Failure;
use posegate::contain::Cause;
use posegate::gate::{InterlockFault, InvalidParameter, Reason};
use posegate::sequencer::{RulesError, StopReason};
use posegate::set::InputError;
use posegate::sight::FailedConstraint;
use posegate::table::{Table, TableError};
use posegate::task::{GrowthError, ModelError};
use posegate::wire::WireError;

/// Every error of the core, by type.
fn errors() -> Vec<(&'static str, Vec<Box<dyn Error>>)> {
    fn boxed<E: Error + 'static>(errors: impl IntoIterator<Item = E>) -> Vec<Box<dyn Error>> {
        let boxed = errors.into_iter().map(|error| Box::new(error) as _);
        boxed.collect()
    }
    vec![
        (
            "InputError",
            boxed([
                InputError::EstimateNotFinite,
                InputError::EstimateOutOfRange,
                InputError::CovarianceNotFinite,
                InputError::CovarianceZero,
                InputError::CovarianceNotSymmetric,
                InputError::CovarianceNotPositiveDefinite,
                InputError::CovarianceTooLarge,
                InputError::BoundInvalid,
                InputError::CovarianceUnknown,
                InputError::OrientationInvalid,
                InputError::Tilted,
            ]),
        ),
        (
            "TableError",
            boxed([
                TableError::TooShort,
                TableError::Magic,
                TableError::Length,
                TableError::Checksum,
                TableError::TooNew,
                TableError::Header,
                TableError::Grid,
                TableError::Facets,
                TableError::Sight,
                TableError::NoCells,
            ]),
        ),
        (
            "GrowthError",
            boxed([
                GrowthError::Model(ModelError("k_turn")),
                GrowthError::NoLegs,
                GrowthError::Pose(InputError::EstimateOutOfRange),
                GrowthError::TooLarge,
            ]),
        ),
        ("ModelError", boxed([ModelError("a1")])),
        (
            "Failure",
            boxed([
                Failure::NotContained(Cause::NotContained),
                Failure::StartTooFar,
                Failure::BeyondNumbers,
            ]),
        ),
        (
            "Cause",
            boxed([Cause::TooLarge, Cause::OffTable, Cause::NotContained]),
        ),
        (
            "RulesError",
            boxed([
                RulesError::Length,
                RulesError::Header,
                RulesError::Checksum,
                RulesError::Name,
                RulesError::Rule,
            ]),
        ),
        (
            "InvalidParameter",
            boxed([
                InvalidParameter::MaximumAge,
                InvalidParameter::ResponseTime,
                InvalidParameter::PermitHold,
                InvalidParameter::InhibitHold,
                InvalidParameter::PermitsInARow,
                InvalidParameter::Task,
                InvalidParameter::Sources,
                InvalidParameter::Frame,
                InvalidParameter::Inflation,
                InvalidParameter::InterlockTime,
            ]),
        ),
        (
            "InterlockFault",
            boxed([
                InterlockFault::Output,
                InterlockFault::Input,
                InterlockFault::NotFollowing,
                InterlockFault::Heartbeat,
                InterlockFault::OldPermission,
            ]),
        ),
        (
            "WireError",
            boxed([
                WireError::Frame,
                WireError::Checksum,
                WireError::Content,
                WireError::Table,
            ]),
        ),
    ]
}

/// A message is read after a colon: no capital at its beginning, unless it is an acronym, and no full stop.
fn is_message(text: &str) -> bool {
    let first: Vec<char> = text.chars().take(2).collect();
    matches!(first[..], [a, b] if !a.is_uppercase() || b.is_uppercase())
        && text.contains(' ')
        && text.is_ascii()
        && !text.ends_with('.')
        && text.split(": ").all(|part| part.split(' ').count() <= 25)
}

#[test]
fn every_error_has_a_distinct_message() {
    for (name, errors) in errors() {
        let texts: BTreeSet<String> = errors.iter().map(ToString::to_string).collect();
        assert_eq!(texts.len(), errors.len(), "{name}: {texts:?}");
        for text in &texts {
            assert!(is_message(text), "{name}: {text:?}");
        }
    }
}

#[test]
fn nested_errors_contain_the_message_of_their_cause() {
    let nested: [(Box<dyn Error>, &str); 3] = [
        (
            Box::new(GrowthError::Model(ModelError("k_turn"))),
            "the gain k_turn is negative, NaN or infinite",
        ),
        (
            Box::new(GrowthError::Pose(InputError::EstimateNotFinite)),
            "a pose of the path is not valid: a coordinate of the estimate is NaN or infinite",
        ),
        (
            Box::new(Failure::NotContained(Cause::OffTable)),
            "the estimate is not on the table",
        ),
    ];
    for (error, text) in nested {
        assert_eq!(error.to_string(), text);
        // A program that prints the chain of causes would print them twice.
        assert!(error.source().is_none());
    }
}

#[test]
fn non_error_answers_have_a_message() {
    let texts = [
        StopReason::Done.to_string(),
        StopReason::GaveUp.to_string(),
        StopReason::NoEntry.to_string(),
        FailedConstraint::Distance.to_string(),
        FailedConstraint::Depth.to_string(),
        FailedConstraint::Image.to_string(),
        FailedConstraint::Phi.to_string(),
        FailedConstraint::Psi.to_string(),
    ];
    for text in texts {
        assert!(is_message(&text), "{text:?}");
    }
}

#[test]
fn a_reason_is_an_error_with_its_name_as_text() {
    let reason: Box<dyn Error> = Box::new(Reason::CovarianceZero);
    assert_eq!(reason.to_string(), "covariance_zero");
}

#[test]
fn a_program_can_return_the_errors_with_a_question_mark() {
    fn table(bytes: &[u8]) -> Result<Table<'_>, Box<dyn Error>> {
        Ok(Table::parse(bytes)?)
    }
    let error = table(b"POSEGATE").unwrap_err();
    assert_eq!(
        error.to_string(),
        "the bytes are fewer than a table's header and checksum"
    );
}
