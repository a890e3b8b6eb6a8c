// SPDX-License-Identifier: MIT
//! mcap_writer IN OUT CHUNK_BYTES: writes the messages of the recording IN, which are read into
//! memory first, to the new file OUT, with zstd level 1 and chunks of CHUNK_BYTES. Prints the
//! processor time of the writing in ns and the bytes of OUT.

use mcap::{records::MessageHeader, Compression, MessageStream, WriteOptions, Writer};
use std::{collections::HashMap, error::Error, fs, hint::black_box, io::BufWriter};

struct Stored {
    header: MessageHeader,
    data: Vec<u8>,
}

type Out = Writer<BufWriter<fs::File>>;

fn cpu_ns() -> i64 {
    let mut ts = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    unsafe { libc::clock_gettime(libc::CLOCK_PROCESS_CPUTIME_ID, &mut ts) };
    ts.tv_sec * 1_000_000_000 + ts.tv_nsec
}

/// All messages of @recording, with the channel ids that @writer has given.
fn load(recording: &[u8], writer: &mut Out) -> Result<Vec<Stored>, Box<dyn Error>> {
    let mut ids = HashMap::new();
    let mut stored = Vec::new();
    for message in MessageStream::new(recording)? {
        let message = message?;
        let channel = message.channel;
        let channel_id = match ids.get(&channel.topic) {
            Some(id) => *id,
            None => {
                let schema = channel.schema.as_ref().ok_or("a channel without a schema")?;
                let schema_id = writer.add_schema(&schema.name, &schema.encoding, &schema.data)?;
                let encoding = &channel.message_encoding;
                let id =
                    writer.add_channel(schema_id, &channel.topic, encoding, &channel.metadata)?;
                ids.insert(channel.topic.clone(), id);
                id
            }
        };
        let header = MessageHeader {
            channel_id,
            sequence: message.sequence,
            log_time: message.log_time,
            publish_time: message.publish_time,
        };
        stored.push(Stored { header, data: message.data.into_owned() });
    }
    Ok(stored)
}

/// What callgrind counts.
#[inline(never)]
#[no_mangle]
fn counted(writer: &mut Out, stored: &[Stored]) -> mcap::McapResult<()> {
    for message in stored {
        writer.write_to_known_channel(&message.header, &message.data)?;
    }
    writer.finish().map(|_| ())
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, from, to, chunk_bytes] = arguments.as_slice() else {
        return Err("usage: mcap_writer IN OUT CHUNK_BYTES".into());
    };
    let recording = fs::read(from)?;
    let file = BufWriter::new(fs::File::create_new(to)?);
    let mut writer = WriteOptions::new()
        .compression(Some(Compression::Zstd))
        .compression_level(1)
        .chunk_size(Some(chunk_bytes.parse()?))
        .profile("ros2")
        .create(file)?;
    let stored = load(&recording, &mut writer)?;
    let before = cpu_ns();
    let written = counted(&mut writer, &stored);
    let used = cpu_ns() - before;
    black_box(&stored);
    written?;
    println!("{used} ns, {} bytes, {} messages", fs::metadata(to)?.len(), stored.len());
    Ok(())
}
