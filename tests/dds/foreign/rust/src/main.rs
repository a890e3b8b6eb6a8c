// SPDX-License-Identifier: MIT
//! rust_subscriber DOMAIN INTERFACE SECONDS OUT [sample|block]: what comes on ecdaq/sample or
//! ecdaq/block, as CSV, for some seconds, on RustDDS. Prints "ready" with the first sample.
//! RustDDS takes every interface there is; INTERFACE is there to be called as the others are.

mod types;

use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::time::{Duration, Instant};

use mio::{Events, Interest, Poll, Token};
use rustdds::policy::{Durability, History, Reliability, ResourceLimits};
use rustdds::with_key::{DataReader, Sample};
use rustdds::{DomainParticipant, Keyed, QosPolicyBuilder, ReadCondition, TopicKind};
use serde::de::DeserializeOwned;
use types::{BlockV1, Rows, SampleV1};

const HEAD: &str =
    "slave,session,cycle,dc_time_ns,flags,is_good,adc,counter,sample_time_ns,raw,taken_ns";
const MOST_SAMPLES: i32 = 50_000;
const FIRST: Duration = Duration::from_secs(30);

fn now_ns() -> i64 {
    let mut now = libc::timespec {
        tv_sec: 0,
        tv_nsec: 0,
    };
    // SAFETY: now is a timespec of ours.
    unsafe { libc::clock_gettime(libc::CLOCK_MONOTONIC, &mut now) };
    now.tv_sec * 1_000_000_000 + now.tv_nsec
}

fn make_reader<T>(
    participant: &DomainParticipant,
    topic: &str,
    type_name: &str,
) -> Result<DataReader<T>, Box<dyn Error>>
where
    T: Keyed + DeserializeOwned + 'static,
    T::K: DeserializeOwned,
{
    let qos = QosPolicyBuilder::new()
        .reliability(Reliability::Reliable {
            max_blocking_time: rustdds::Duration::from_millis(100),
        })
        .durability(Durability::Volatile)
        .history(History::KeepAll)
        // RustDDS' own limit is 64 samples, and what is beyond it is lost.
        .resource_limits(ResourceLimits {
            max_samples: MOST_SAMPLES,
            max_instances: MOST_SAMPLES,
            max_samples_per_instance: MOST_SAMPLES,
        })
        .build();
    let topic = participant.create_topic(
        topic.to_string(),
        type_name.to_string(),
        &qos,
        TopicKind::WithKey,
    )?;
    Ok(participant
        .create_subscriber(&qos)?
        .create_datareader_cdr::<T>(&topic, Some(qos))?)
}

fn subscribe<T>(
    mut reader: DataReader<T>,
    seconds: f64,
    mut out: impl Write,
) -> Result<(), Box<dyn Error>>
where
    T: Keyed + DeserializeOwned + Rows + 'static,
    T::K: DeserializeOwned,
{
    let mut poll = Poll::new()?;
    let mut events = Events::with_capacity(4);
    let mut end = Instant::now() + FIRST;
    let mut is_ready = false;

    poll.registry()
        .register(&mut reader, Token(0), Interest::READABLE)?;
    writeln!(out, "{HEAD}")?;
    while Instant::now() < end {
        poll.poll(&mut events, Some(Duration::from_millis(100)))?;
        // All at once: RustDDS looks through everything that waits at each take.
        let taken = reader.take(usize::MAX, ReadCondition::any())?;
        let taken_ns = now_ns();
        if !taken.is_empty() && !is_ready {
            is_ready = true;
            end = Instant::now() + Duration::from_secs_f64(seconds);
            println!("ready");
        }
        for sample in taken {
            if let Sample::Value(message) = sample.into_value() {
                message.put(&mut out, taken_ns)?;
            }
        }
    }
    out.flush()?;
    if !is_ready {
        return Err("nothing came".into());
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().collect();
    if words.len() != 5 && words.len() != 6 {
        return Err("usage: rust_subscriber DOMAIN INTERFACE SECONDS OUT [sample|block]".into());
    }
    let participant = DomainParticipant::new(words[1].parse()?)?;
    let seconds: f64 = words[3].parse()?;
    let out = BufWriter::new(File::create(&words[4])?);
    if words.get(5).is_some_and(|what| what == "block") {
        let reader = make_reader::<BlockV1>(&participant, "ecdaq/block", "ecdaq::BlockV1")?;
        subscribe(reader, seconds, out)
    } else {
        let reader = make_reader::<SampleV1>(&participant, "ecdaq/sample", "ecdaq::SampleV1")?;
        subscribe(reader, seconds, out)
    }
}
