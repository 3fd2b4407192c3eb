use super::*;

#[test]
fn cells_contain_equally_many_numbers() {
    let numbers: Vec<f64> = (0..10_000).map(|k| 0.5 + f64::from(k) * 6e-4).collect();
    let axis = over(&numbers, 0, 5, PARTS[0]).unwrap();
    assert_eq!(axis.cells(), 10);
    assert_eq!((axis.edges[0], axis.edges[10]), (0.5, 6.5));
    for cell in 0..10 {
        let held = numbers
            .iter()
            .filter(|x| axis.cell(**x) == Some(cell))
            .count();
        assert!((980..=1020).contains(&held), "{cell}: {held}");
    }
    assert_eq!(axis.cell(0.49), None);
    assert_eq!(axis.cell(6.51), None);
    assert_eq!(axis.touched(axis.edges[3]), Some([2, 3]));
    assert_eq!(axis.touched(axis.edges[10]), Some([9, 9]));
}

#[test]
fn outliers_do_not_widen_cells() {
    let mut numbers: Vec<f64> = (0..1000).map(|k| 1.0 + f64::from(k) * 0.004).collect();
    numbers.extend([20.0, 30.0]);
    let axis = over(&numbers, 0, 4, PARTS[0]).unwrap();
    assert!(*axis.edges.last().unwrap() <= 5.0);
    // The gap from the smallest angle to 0 closes if it is small.
    let angles: Vec<f64> = (0..1000).map(|k| 0.1 + f64::from(k) * 0.07).collect();
    assert_eq!(over(&angles, 2, 4, PARTS[2]).unwrap().edges[0], 0.0);
    let angles: Vec<f64> = (0..1000).map(|k| 30.0 + f64::from(k) * 0.03).collect();
    assert_eq!(over(&angles, 2, 4, PARTS[2]).unwrap().edges[0], 30.0);
    // For psi only a gap of up to one degree closes.
    let angles: Vec<f64> = (0..1000).map(|k| 2.0 + f64::from(k) * 0.07).collect();
    assert_eq!(over(&angles, 1, 2, PARTS[1]).unwrap().edges[0], 0.0);
    assert_eq!(over(&angles, 2, 2, PARTS[2]).unwrap().edges[0], 2.0);
    // Equal numbers, and no numbers.
    assert!(over(&[2.0; 50], 0, 3, PARTS[0]).is_some());
    assert!(over(&[0.0; 50], 1, 3, PARTS[1]).is_some());
    assert!(over(&[], 0, 3, PARTS[0]).is_none());
}

/// A coarse cell of four parts is complete even if all of its numbers are equal or nearly equal.
#[test]
fn repeated_numbers_fill_four_parts() {
    for numbers in [std::vec![2.0; 50], std::vec![2.0, 2.001, 2.001, 2.001]] {
        let axis = over(&numbers, 0, 3, 4).unwrap();
        assert_eq!(axis.cells() % 4, 0);
        assert!(axis.cell(2.0).is_some());
    }
}

#[test]
fn gaps_are_cells_of_their_own() {
    let mut numbers: Vec<f64> = (0..1000).map(|k| 0.5 + f64::from(k) * 0.0018).collect();
    numbers.extend((0..1000).map(|k| 4.7 + f64::from(k) * 0.0013));
    let axis = over(&numbers, 0, 6, PARTS[0]).unwrap();
    let gap = axis.cell(3.5).unwrap();
    let [low, high] = [gap / 2, gap / 2 + 1].map(|coarse| axis.edges[2 * coarse]);
    assert!(
        (2.298..2.31).contains(&low) && (4.69..=4.7).contains(&high),
        "{low} {high}"
    );
    // A few distinct numbers.
    let few: Vec<f64> = (0..400).map(|k| f64::from(1 + k % 4)).collect();
    let axis = over(&few, 0, 3, PARTS[0]).unwrap();
    for k in 1..=4 {
        let coarse = axis.cell(f64::from(k)).unwrap() / 2;
        let ends = [axis.edges[2 * coarse], axis.edges[2 * coarse + 2]];
        assert!(narrow(0, ends), "{ends:?}");
    }
    assert_eq!(axis.cells(), 14);
}
