//! Tables of known answers: deterministic quadrature and closed forms, made independently of this program. Each value
//! has an estimate of its absolute error.

use serde_json::Value;

/// One row of a table.
pub struct Row {
    pub id: String,
    value: Value,
}

/// The rows of `tests/truth/{name}.json`.
pub fn table(name: &str) -> Vec<Row> {
    let path = format!("{}/tests/truth/{name}.json", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}"));
    let whole: Value = serde_json::from_str(&text).unwrap_or_else(|error| panic!("{path}: {error}"));
    let rows = whole["rows"].as_array().expect("a table has rows");
    rows.iter()
        .map(|row| Row { id: row["id"].as_str().expect("a row has an id").to_owned(), value: row.clone() })
        .collect()
}

impl Row {
    /// A number of the input.
    pub fn number(&self, name: &str) -> f64 {
        self.value["in"][name].as_f64().unwrap_or_else(|| panic!("{}: no {name}", self.id))
    }

    /// A list of the input.
    pub fn list(&self, name: &str) -> Vec<f64> {
        numbers(&self.value["in"][name]).unwrap_or_else(|| panic!("{}: no {name}", self.id))
    }

    /// Values of the output and their absolute error.
    pub fn output(&self, name: &str) -> (Vec<f64>, f64) {
        let entry = &self.value["out"][name];
        let error = entry[1].as_f64().unwrap_or_else(|| panic!("{}: no {name}", self.id));
        (numbers(&entry[0]).unwrap_or_else(|| panic!("{}: no {name}", self.id)), error)
    }
}

fn numbers(value: &Value) -> Option<Vec<f64>> {
    match value.as_array() {
        Some(list) => list.iter().map(Value::as_f64).collect(),
        None => Some(vec![value.as_f64()?]),
    }
}
