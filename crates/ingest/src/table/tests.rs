use super::*;
use proptest::prelude::*;

fn format(separator: Separator, decimal_comma: bool) -> RowFormat {
    let field = |column| Field::Value { column, needed: column < 3 };
    RowFormat {
        separator,
        decimal_comma,
        newline: b'\n',
        fields: (0..4).map(field).collect(),
        columns: 4,
        free: true,
    }
}

#[test]
fn faults_name_line_and_value() {
    let text = b"# a\n1 2 3 4\n\n5 6 7\n2\n1 x 3 4\n1 2 3 oak\n 9\t9 9 9 9 \n";
    let rows = format(Separator::Blanks, false).rows(text);
    assert_eq!(rows.lines, [1, 6, 7]);
    assert_eq!(rows.columns[0], [1.0, 1.0, 9.0]);
    assert!(rows.columns[3][1].is_nan());
    assert_eq!(rows.faults[0], (3, "3 columns, expected 4: `5 6 7`".to_owned()));
    assert_eq!(rows.faults[1], (5, "`x` is no number".to_owned()));
    assert_eq!((rows.counts.as_slice(), rows.no_numbers, rows.longer), (&[(4, 2)][..], 1, 1));
    assert_eq!((rows.others.as_slice(), rows.line_count, rows.len()), (&[0, 2, 4][..], 8, 5));
}

#[test]
fn separators_and_commas() {
    let check = |format: &RowFormat, line: &str| {
        let rows = format.rows(line.as_bytes());
        assert!(rows.faults.is_empty(), "{line}: {:?}", rows.faults);
        rows.columns.iter().map(|column| column[0]).collect::<Vec<f64>>()
    };
    let expected = vec![1.5, -2.0, 3e2, 4.0];
    assert_eq!(check(&format(Separator::Char(b','), false), "1.5 , -2,3e2, 4"), expected);
    assert_eq!(check(&format(Separator::Char(b';'), true), "1,5;-2; 3e2;4;"), expected);
    assert_eq!(check(&format(Separator::Char(b'\t'), false), "\"1.5\"\t-2\t+3e2\t4\r"), expected);
    assert_eq!(check(&format(Separator::Blanks, true), "1,5  -2,0 300\t4"), expected);
    let missing = check(&format(Separator::Char(b';'), false), "1;2;3;;");
    assert!(missing[3].is_nan());
    assert_eq!(number(b"1.5", true), None);
    assert_eq!(number(b"1,2,3", true), None);
}

#[test]
fn lists_are_stepped_over() {
    let mut format = format(Separator::Blanks, false);
    format.free = false;
    format.columns = 2;
    format.fields = vec![
        Field::Value { column: 0, needed: true },
        Field::List,
        Field::Value { column: 1, needed: true },
    ];
    let rows = format.rows(b"1 2 7 7 5\n2 0 6\n3 4 1 2\n");
    assert_eq!(rows.columns, [vec![1.0, 2.0], vec![5.0, 6.0]]);
    assert_eq!(rows.faults[0].0, 2);
}

#[test]
fn the_first_rows_are_kept() {
    let mut rows = format(Separator::Blanks, false).rows(b"1 2 3 4\n\n2 2\n\n3 2 3 4\n4 2 3 4\n");
    rows.truncate(3);
    assert_eq!((rows.lines.as_slice(), rows.faulty, rows.len()), (&[0, 4][..], 1, 3));
    rows.truncate(1);
    assert_eq!((rows.lines.as_slice(), rows.faulty, rows.faults.len()), (&[0][..], 0, 0));
}

proptest! {
    /// What is written with all its digits is read as it was, in whatever pieces.
    #[test]
    fn numbers_come_back(
        rows in prop::collection::vec(prop::array::uniform4(-1e7f64..1e7), 1..60),
        comma in any::<bool>(),
    ) {
        let (separator, mark) = if comma { (Separator::Char(b';'), ";") } else { (Separator::Blanks, " ") };
        let mut text = String::new();
        for row in &rows {
            let values: Vec<String> = row.iter().map(|v| format!("{v}").replace('.', if comma { "," } else { "." })).collect();
            text.push_str(&values.join(mark));
            text.push('\n');
        }
        let found = format(separator, comma).rows(text.as_bytes());
        prop_assert!(found.faults.is_empty(), "{:?}", found.faults);
        for column in 0..4 {
            let expected: Vec<f64> = rows.iter().map(|row| row[column]).collect();
            prop_assert_eq!(&found.columns[column], &expected);
        }
    }

    #[test]
    fn any_bytes_are_rows_or_faults(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        for separator in [Separator::Blanks, Separator::Char(b','), Separator::Char(b';')] {
            let rows = format(separator, true).rows(&bytes);
            prop_assert!(rows.columns.iter().all(|column| column.len() == rows.lines.len()));
            prop_assert!(rows.len() + rows.others.len() as u64 <= rows.line_count);
        }
    }
}
