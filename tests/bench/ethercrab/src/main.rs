// SPDX-License-Identifier: MIT
//! A cyclic loop on EtherCrab, as its own example dc.rs does it: SYNC0 in all slaves once their
//! clocks are aligned, deadlines from the reference clock. The command line, the output and the
//! records are those of tests/bench/loops/loop.h.

use ethercrab::{
    error::Error,
    std::{ethercat_now, tx_rx_task},
    subdevice_group::{DcConfiguration, HasDc, Op},
    DcSync, MainDevice, MainDeviceConfig, PduStorage, RetryBehaviour, SubDeviceGroup, Timeouts,
};
use std::{io::Write, time::Duration};

const MAX_SLAVES: usize = 128;
const MAX_FRAMES: usize = 32;
const MAX_PDU_DATA: usize = PduStorage::element_size(1100);
const IMAGE_BYTES: usize = 4096;
// EtherCrab has one time-out of a PDU for bring-up and cycle, hence two periods and not LIMIT_NS:
// with less, 64 slaves do not come up on a busy machine. A PDU sent again is late in its cycle.
const PDU_PERIODS: u32 = 2;
const RETRIES: usize = 50;

static STORAGE: PduStorage<MAX_FRAMES, MAX_PDU_DATA> = PduStorage::new();

type OpGroup = SubDeviceGroup<MAX_SLAVES, IMAGE_BYTES, ethercrab::DefaultLock, Op, HasDc>;

fn now_ns() -> i64 {
    let mut ts = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    unsafe { libc::clock_gettime(libc::CLOCK_MONOTONIC, &mut ts) };
    ts.tv_sec * 1_000_000_000 + ts.tv_nsec
}

fn sleep_until(deadline_ns: i64) {
    let ts = libc::timespec {
        tv_sec: deadline_ns / 1_000_000_000,
        tv_nsec: deadline_ns % 1_000_000_000,
    };
    unsafe {
        while libc::clock_nanosleep(
            libc::CLOCK_MONOTONIC,
            libc::TIMER_ABSTIME,
            &ts,
            std::ptr::null_mut(),
        ) != 0
        {}
    }
}

fn say(line: String) {
    println!("{line}");
    std::io::stdout().flush().ok();
}

/// Whether the answer is complete, and how long to wait for the next cycle; None: there is none.
async fn exchange(group: &OpGroup, main: &MainDevice<'_>, wkc: u16) -> Option<(bool, Duration)> {
    let answer = group.tx_rx_dc(main).await.ok()?;
    Some((
        answer.working_counter == wkc && answer.all_op(),
        answer.extra.next_cycle_wait,
    ))
}

struct Options {
    nic: String,
    period: Duration,
    settle: i64,
    cycles: i64,
    free_ms: i64,
    file: String,
}

fn options() -> Options {
    let words: Vec<String> = std::env::args().collect();
    if words.len() != 8 {
        eprintln!("usage: ethercrab_loop NIC PERIOD_NS SETTLE CYCLES LIMIT_NS FREE_MS FILE");
        std::process::exit(2);
    }
    let number = |i: usize| -> i64 {
        words[i].parse().unwrap_or_else(|_| {
            eprintln!("'{}' is not a number", words[i]);
            std::process::exit(2)
        })
    };
    Options {
        nic: words[1].clone(),
        period: Duration::from_nanos(number(2) as u64),
        settle: number(3),
        cycles: number(4),
        free_ms: number(6),
        file: words[7].clone(),
    }
}

async fn bring_up(main: &MainDevice<'_>, period: Duration) -> Result<(OpGroup, u16), Error> {
    let mut group = main
        .init_single_group::<MAX_SLAVES, IMAGE_BYTES>(ethercat_now)
        .await?;
    for mut slave in group.iter_mut(main) {
        slave.set_dc_sync(DcSync::Sync0);
    }
    say(format!("slaves {}", group.len()));
    let group = group.into_pre_op_pdi(main).await?;
    let group = group
        .configure_dc_sync(
            main,
            DcConfiguration {
                start_delay: Duration::from_millis(100),
                sync0_period: period,
                sync0_shift: period / 2,
            },
        )
        .await?;
    let group = group.into_safe_op(main).await?;
    let group = group.request_into_op(main).await?;
    loop {
        let wake_ns = now_ns();
        let answer = group.tx_rx_dc(main).await?;
        if answer.all_op() {
            return Ok((group, answer.working_counter));
        }
        sleep_until(wake_ns + answer.extra.next_cycle_wait.as_nanos() as i64);
    }
}

async fn run(opt: &Options, main: &MainDevice<'_>) -> Result<(), Error> {
    let (group, wkc) = bring_up(main, opt.period).await?;
    let period_ns = opt.period.as_nanos() as i64;
    let mut records: Vec<u8> = Vec::with_capacity(opt.cycles as usize * 40);
    unsafe { libc::mlockall(libc::MCL_CURRENT | libc::MCL_FUTURE) };
    say(format!("op {}", now_ns()));
    let mut deadline_ns = now_ns() + period_ns;
    for i in -opt.settle..opt.cycles {
        sleep_until(deadline_ns);
        let wake_ns = now_ns();
        let late_ns = wake_ns - deadline_ns;
        let answer = exchange(&group, main, wkc).await;
        let round_ns = now_ns() - wake_ns;
        deadline_ns += period_ns;
        let is_complete = match answer {
            // As the example does it: from the wake of this cycle on.
            Some((is_complete, wait)) => {
                if late_ns + round_ns < period_ns {
                    deadline_ns = wake_ns + wait.as_nanos() as i64;
                }
                is_complete
            }
            None => false,
        };
        if i >= 0 {
            for value in [wake_ns, late_ns, 0, round_ns, is_complete as i64] {
                records.extend_from_slice(&value.to_le_bytes());
            }
        }
    }
    std::fs::write(&opt.file, &records).expect("FILE");
    if opt.free_ms > 0 {
        let start_ns = now_ns();
        let mut answers = 0;
        while now_ns() - start_ns < opt.free_ms * 1_000_000 {
            if let Some((true, _)) = exchange(&group, main, wkc).await {
                answers += 1;
            }
        }
        say(format!("free {answers} {}", now_ns() - start_ns));
    }
    Ok(())
}

fn main() {
    let opt = options();
    let (tx, rx, pdu_loop) = STORAGE.try_split().expect("storage");
    let main = MainDevice::new(
        pdu_loop,
        Timeouts {
            pdu: opt.period * PDU_PERIODS,
            eeprom: Duration::from_millis(100),
            state_transition: Duration::from_secs(10),
            wait_loop_delay: Duration::from_millis(2),
            ..Timeouts::default()
        },
        MainDeviceConfig {
            retry_behaviour: RetryBehaviour::Count(RETRIES),
            ..MainDeviceConfig::default()
        },
    );
    match tx_rx_task(&opt.nic, tx, rx) {
        Ok(task) => smol::spawn(task).detach(),
        Err(why) => {
            eprintln!("ethercrab: {}: {why}", opt.nic);
            std::process::exit(1);
        }
    }
    if let Err(why) = smol::block_on(run(&opt, &main)) {
        eprintln!("ethercrab: {why}");
        std::process::exit(1);
    }
    // The slaves' watchdogs bring them to SAFE-OP.
    std::process::exit(0);
}
