//! Writes a replay as MCAP: JSON channels that can be plotted with the bag they were computed from.

use super::Row;
use crate::mcap::{Head, Writer};
use posegate::gate::Reason;
use serde_json::{Value, json};
use std::io::{self, Write};

/// Schema: verdict and permission of each estimate.
const VERDICT: &str = r#"{"type":"object","title":"posegate.Verdict","properties":{"t_s":{"type":["number","null"]},"permit":{"type":"integer"},"open":{"type":"integer"},"margin":{"type":["number","null"]},"age_s":{"type":["number","null"]},"reason":{"type":["string","null"]},"gate_reason":{"type":["string","null"]},"state":{"type":"string"},"x_m":{"type":["number","null"]},"y_m":{"type":["number","null"]},"yaw_rad":{"type":["number","null"]}}}"#;
/// Schema: the results of other rules.
const RULES: &str = r#"{"type":"object","title":"posegate.Rules","properties":{"distance":{"type":["integer","null"]},"sigma":{"type":["integer","null"]},"ellipse":{"type":["integer","null"]}}}"#;
/// Schema: each estimate compared with the truth.
const TRUTH: &str = r#"{"type":"object","title":"posegate.Truth","properties":{"error_m":{"type":["number","null"]},"error_yaw_rad":{"type":["number","null"]},"in_success_set":{"type":"integer"},"in_pose_set":{"type":["integer","null"]},"nees":{"type":["number","null"]},"scale":{"type":["number","null"]}}}"#;
/// Schema: the summary, written once.
const SUMMARY: &str = r#"{"type":"object","title":"posegate.Summary"}"#;

/// A writer of a file with JSON channels.
pub struct Channels<W: Write> {
    writer: Writer<W>,
    ids: [u16; 4],
    last_ns: u64,
    sequence: u32,
    text: std::vec::Vec<u8>,
}

impl<W: Write> Channels<W> {
    /// Begins a file with the topics `/posegate/verdict`, `/posegate/rules`, `/posegate/truth` (if the truth is
    /// known) and `/posegate/summary`.
    ///
    /// # Errors
    /// The output cannot be written.
    pub fn new(output: W) -> io::Result<Self> {
        let library = concat!("posegate ", env!("CARGO_PKG_VERSION"));
        let mut writer = Writer::new(output, library)?;
        let mut ids = [0; 4];
        let all = [
            ("verdict", "posegate.Verdict", VERDICT),
            ("rules", "posegate.Rules", RULES),
            ("truth", "posegate.Truth", TRUTH),
            ("summary", "posegate.Summary", SUMMARY),
        ];
        for (id, (topic, name, schema)) in ids.iter_mut().zip(all) {
            let schema = writer.add_schema(name, "jsonschema", schema.as_bytes())?;
            let topic = String::from("/posegate/") + topic;
            *id = writer.add_channel(schema, &topic, "json")?;
        }
        Ok(Self {
            writer,
            ids,
            last_ns: 0,
            sequence: 0,
            text: std::vec::Vec::new(),
        })
    }

    /// Adds a row at the time when its estimate was recorded, or at the previous row's time if it has none.
    ///
    /// # Errors
    /// The output cannot be written.
    pub fn row(&mut self, row: &Row) -> io::Result<()> {
        let now_s = row.now_s();
        if now_s.is_finite() && now_s >= 0.0 {
            self.last_ns = libm::round(now_s * 1e9) as u64;
        }
        let [verdict, rules, truth, _] = self.ids;
        let [x, y, yaw] = row.pose;
        let line = json!({
            "t_s": row.t_s,
            "permit": u8::from(row.verdict.is_permit()),
            "open": u8::from(row.permitted),
            "margin": row.margin(),
            "age_s": row.age_s(),
            "reason": row.reason().map(Reason::name),
            "gate_reason": row.step.err().map(Reason::name),
            "state": row.state.name(),
            "x_m": x, "y_m": y, "yaw_rad": yaw,
        });
        self.write(verdict, &line)?;
        let mut line = json!({});
        for (name, permits) in super::RULES.iter().zip(row.rules) {
            line[*name] = json!(permits.map(u8::from));
        }
        self.write(rules, &line)?;
        if let Some(against) = &row.against {
            let line = json!({
                "error_m": against.error_m,
                "error_yaw_rad": against.error_yaw_rad,
                "in_success_set": u8::from(against.inside),
                "in_pose_set": against.held.map(u8::from),
                "nees": against.nees,
                "scale": against.scale,
            });
            self.write(truth, &line)?;
        }
        self.sequence = self.sequence.wrapping_add(1);
        Ok(())
    }

    /// Adds the summary, ends the file and returns the output.
    ///
    /// # Errors
    /// The output cannot be written.
    pub fn finish(mut self, summary: &Value) -> io::Result<W> {
        self.write(self.ids[3], summary)?;
        self.writer.finish()
    }

    fn write(&mut self, channel: u16, line: &Value) -> io::Result<()> {
        self.text.clear();
        // Writing to memory cannot fail, and all keys are strings.
        let _ = serde_json::to_writer(&mut self.text, line);
        let head = Head {
            channel,
            sequence: self.sequence,
            time_ns: self.last_ns,
        };
        self.writer.write(head, &self.text)
    }
}
