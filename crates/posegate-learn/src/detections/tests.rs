use super::*;

const HEADER: &str = "d_m,phi_deg,psi_deg,detected,err_translation_m,err_yaw_rad\n";

fn read(text: &str) -> Result<Detections, String> {
    Detections::read(text.as_bytes(), "d.csv").map_err(|error| format!("{error}"))
}

#[test]
fn rows_are_read_by_name() {
    let found = read(
        "psi_deg,other,detected,d_m,phi_deg,err_yaw_rad,err_translation_m\n30,x,1,2.5,4,-0.01,0.02\n31,,0,3,5,,\n",
    )
    .unwrap();
    assert_eq!(found.rows[0].at, [2.5, 4.0, 30.0]);
    assert_eq!(found.rows[0].errors, Some([0.02, 0.01]));
    assert_eq!(found.rows[1].errors, None);
}

/// A row in the middle of the file that is not drawn is also checked, and the digest is that of the complete
/// file.
#[test]
fn long_files_are_drawn_from_and_checked() {
    let row = |k: u32| format!("{},2,3,1,0.1,0.2\n", 1 + k);
    let text: String = HEADER.into();
    let text = (0..1000).fold(text, |text, k| text + &row(k));
    let drawn = |text: &str| Detections::drawn(text.as_bytes(), "d.csv", 100, 1);
    let found = drawn(&text).unwrap();
    assert_eq!((found.rows.len(), found.drawn_of), (100, Some(1000)));
    let complete = read(&text).unwrap();
    assert_eq!((found.sha256, complete.drawn_of), (complete.sha256, None));
    let kept = |k: u32| found.rows.iter().any(|row| row.at[0] == f64::from(1 + k));
    let dropped = (500..1000).find(|k| !kept(*k)).unwrap();
    let error = drawn(&text.replace(&row(dropped), "nan,2,3,1,0.1,0.2\n")).unwrap_err();
    let place = format!("d.csv:{}:1: `nan`", dropped + 2);
    assert!(error.to_string().starts_with(&place), "{error}");
    // All dependent rows are kept: a run is not thinned.
    let runs = text
        .replace("rad\n", "rad,run\n")
        .replace("0.2\n", "0.2,a\n");
    let found = drawn(&runs).unwrap();
    assert_eq!((found.rows.len(), found.drawn_of), (1000, None));
}

/// Spaces around fields and a byte order mark are ignored.
#[test]
fn fields_are_trimmed() {
    let header = HEADER.replace(',', " , ");
    let found = read(&format!(
        "\u{feff} {header} 2.5 ,4, 30,1 , 0.02,-0.01 \n31,0,3, 0 , ,\n"
    ));
    let found = found.unwrap();
    assert_eq!(found.rows[0].at, [2.5, 4.0, 30.0]);
    assert_eq!(found.rows[1].errors, None);
}

/// Both errors are those of the better pose.
#[test]
fn errors_are_those_of_the_better_pose() {
    let header = HEADER.replace("rad\n", "rad,second_err_translation_m,second_err_yaw_rad\n");
    let found = read(&format!(
        "{header}1,2,3,1,0.1,0.2,0.3,-0.1\n1,2,3,1,0.1,0.2,0.05,0.4\n1,2,3,1,0.1,0.2,,\n1,2,3,0,,,,\n"
    ))
    .unwrap();
    let errors: Vec<_> = found.rows.iter().map(|row| row.errors).collect();
    let first = Some([0.1, 0.2]);
    assert_eq!(errors, [Some([0.3, 0.1]), first, first, None]);
    assert!(found.of_better_pose);
    assert!(
        !read(&format!("{HEADER}1,2,3,1,0.1,0.2\n"))
            .unwrap()
            .of_better_pose
    );
    for (row, place) in [
        ("1,2,3,1,0.1,0.2,0.3,\n", "d.csv:2:8: ``"),
        ("1,2,3,1,0.1,0.2,,0.1\n", "d.csv:2:7: ``"),
        ("1,2,3,1,0.1,0.2,nan,0.1\n", "d.csv:2:7: `nan`"),
        ("1,2,3,0,,,0.1,\n", "d.csv:2:7: `0.1`"),
    ] {
        let error = read(&format!("{header}{row}")).unwrap_err();
        assert!(error.starts_with(place), "{row}: {error}");
    }
    let half = header.replace(",second_err_yaw_rad", "");
    let error = read(&half).unwrap_err();
    assert!(
        error.starts_with("d.csv:1:1: there is no column `second_err_yaw_rad`"),
        "{error}"
    );
    let half = header.replace(",second_err_translation_m", "");
    let error = read(&half).unwrap_err();
    assert!(
        error.starts_with("d.csv:1:1: there is no column `second_err_translation_m`"),
        "{error}"
    );
}

#[test]
fn errors_state_file_line_and_column() {
    let good = "1,2,3,1,0.1,0.2\n";
    for (row, place) in [
        ("nan,2,3,1,0.1,0.2\n", "d.csv:3:1: `nan` in `d_m`"),
        ("-1,2,3,1,0.1,0.2\n", "d.csv:3:1: `-1`"),
        ("1,2,190,1,0.1,0.2\n", "d.csv:3:3: `190` in `psi_deg`"),
        ("1,2,3,2,0.1,0.2\n", "d.csv:3:4: `2` in `detected`"),
        ("1,2,3,yes,0.1,0.2\n", "d.csv:3:4: `yes`"),
        ("1,2,3,1,,0.2\n", "d.csv:3:5: `` in `err_translation_m`"),
        ("1,2,3,1,-0.1,0.2\n", "d.csv:3:5: `-0.1`"),
        ("1,2,3,1,0.1,inf\n", "d.csv:3:6: `inf` in `err_yaw_rad`"),
        ("1,2,3,0,0.1,\n", "d.csv:3:5: `0.1`"),
        ("1,2,3,0,,0.2\n", "d.csv:3:6: `0.2`"),
        ("1,2,3,1,0.1\n", "d.csv:3:6: 5 fields"),
    ] {
        let error = read(&format!("{HEADER}{good}{row}")).unwrap_err();
        assert!(error.starts_with(place), "{row}: {error}");
    }
    let error = read("d_m,phi_deg\n1,2\n").unwrap_err();
    assert!(
        error.starts_with("d.csv:1:1: there is no column `psi_deg`"),
        "{error}"
    );
    let error = read(&HEADER.replace("phi_deg", "d_m")).unwrap_err();
    assert!(error.starts_with("d.csv:1:2: "), "{error}");
    assert!(read(HEADER).unwrap_err().contains("no row"));
}
