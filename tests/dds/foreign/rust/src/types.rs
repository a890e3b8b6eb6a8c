// SPDX-License-Identifier: MIT
//! SampleV1 and BlockV1 of app/services/publish/idl/ecdaq.idl, and their lines of CSV.

use std::io::{Result, Write};

use rustdds::Keyed;
use serde::{Deserialize, Serialize};

#[derive(Serialize, Deserialize)]
pub struct SampleV1 {
    slave: u16,
    session: u64,
    cycle: u64,
    dc_time_ns: i64,
    utc_ns: i64,
    flags: u32,
    is_good: bool,
    adc: f64,
    counter: u64,
    sample_time_ns: i64,
    values: Vec<f64>,
    raw: Vec<u64>,
}

#[derive(Serialize, Deserialize)]
pub struct BlockV1 {
    slave: u16,
    session: u64,
    count: u32,
    channel_count: u32,
    cycle: Vec<u64>,
    dc_time_ns: Vec<i64>,
    utc_ns: Vec<i64>,
    flags: Vec<u32>,
    is_good: Vec<bool>,
    adc: Vec<f64>,
    counter: Vec<u64>,
    sample_time_ns: Vec<i64>,
    values: Vec<f64>,
    raw: Vec<u64>,
}

impl Keyed for SampleV1 {
    type K = u16;
    fn key(&self) -> u16 {
        self.slave
    }
}

impl Keyed for BlockV1 {
    type K = u16;
    fn key(&self) -> u16 {
        self.slave
    }
}

/// What becomes lines of the file.
pub trait Rows {
    fn put(&self, out: &mut impl Write, taken_ns: i64) -> Result<()>;
}

fn joined(raw: &[u64]) -> String {
    let words: Vec<String> = raw.iter().map(u64::to_string).collect();
    words.join(" ")
}

impl Rows for SampleV1 {
    fn put(&self, out: &mut impl Write, taken_ns: i64) -> Result<()> {
        writeln!(
            out,
            "{},{},{},{},{},{},{},{},{},{},{}",
            self.slave,
            self.session,
            self.cycle,
            self.dc_time_ns,
            self.flags,
            u8::from(self.is_good),
            self.adc,
            self.counter,
            self.sample_time_ns,
            joined(&self.raw),
            taken_ns
        )
    }
}

impl Rows for BlockV1 {
    fn put(&self, out: &mut impl Write, taken_ns: i64) -> Result<()> {
        let n = self.channel_count as usize;
        for k in 0..self.count as usize {
            writeln!(
                out,
                "{},{},{},{},{},{},{},{},{},{},{}",
                self.slave,
                self.session,
                self.cycle[k],
                self.dc_time_ns[k],
                self.flags[k],
                u8::from(self.is_good[k]),
                self.adc[k],
                self.counter[k],
                self.sample_time_ns[k],
                joined(&self.raw[k * n..(k + 1) * n]),
                taken_ns
            )?;
        }
        Ok(())
    }
}
