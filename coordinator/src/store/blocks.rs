//! Reading a long log on several threads: blocks of whole lines are parsed side by side and put together in order, so
//! that entries and damage are those of [`super::scan`], which reads line by line.
//!
//! The caller reads the file and takes what was parsed; block after block goes to the threads in turn. No more blocks
//! than two a thread are on the way, so that memory does not depend on the length of the log.

use super::log::Entry;
use super::scan::{Line, Place, Scan, scan_file, scan_lines};
use super::wire::Form;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;

/// Size of a block, bytes: a thousand lines or so.
const BLOCK_BYTES: usize = 1 << 20;
/// Blocks on the way, for each thread: one that is parsed and one that waits.
const BLOCKS_PER_THREAD: usize = 2;
/// Most threads: reading and putting together keep one busy for some eight that parse.
const MOST_THREADS: usize = 8;

/// Reads the log at `path` and gives every sound entry to `each`, in the order of the log; one that does not exist is
/// empty.
///
/// # Errors
/// Reading fails.
pub(super) fn read_entries<R: Form + Send>(path: &Path, mut each: impl FnMut(Entry<R>)) -> io::Result<Scan> {
    let length = match path.metadata() {
        Ok(metadata) => metadata.len(),
        Err(e) if e.kind() == io::ErrorKind::NotFound => 0,
        Err(e) => return Err(e),
    };
    let threads = thread::available_parallelism().map_or(1, usize::from).min(MOST_THREADS);
    if threads == 1 || length <= BLOCK_BYTES as u64 {
        return scan_file(path, Place::default(), |line: Line<'_, R>| {
            each(line.entry);
            Ok(())
        });
    }
    scan_blocks(File::open(path)?, BLOCK_BYTES, threads, each)
}

/// Reads a log from its start in blocks of about so many bytes, parsed by so many threads.
fn scan_blocks<R: Form + Send>(
    reader: impl Read,
    block_bytes: usize,
    threads: usize,
    mut each: impl FnMut(Entry<R>),
) -> io::Result<Scan> {
    let mut blocks = Blocks { reader, block_bytes, rest: Vec::new(), place: Place::default(), ended: false };
    let mut scan = Scan::default();
    thread::scope(|scope| {
        let parsers: Vec<Parser<R>> = (0..threads)
            .map(|_| {
                let (give, given) = sync_channel::<Block>(BLOCKS_PER_THREAD);
                let (done, take) = sync_channel(BLOCKS_PER_THREAD);
                scope.spawn(move || {
                    given.iter().map(|block| parse(&block)).try_for_each(|parsed| done.send(parsed))
                });
                Parser { give, take }
            })
            .collect();
        let mut take = |number: usize| {
            let (entries, later) = parsers[number % threads].take.recv().expect("parsing does not panic");
            entries.into_iter().for_each(&mut each);
            scan.append(later);
        };
        let on_the_way = BLOCKS_PER_THREAD * threads;
        let mut read = 0;
        while let Some(block) = blocks.next()? {
            if read >= on_the_way {
                take(read - on_the_way);
            }
            parsers[read % threads].give.send(block).expect("parsing does not panic");
            read += 1;
        }
        (read.saturating_sub(on_the_way)..read).for_each(take);
        Ok(())
    })
    .map(|()| scan)
}

/// The two ends of a thread that parses.
struct Parser<R> {
    give: SyncSender<Block>,
    take: Receiver<(Vec<Entry<R>>, Scan)>,
}

/// Whole lines, and where they begin.
struct Block {
    from: Place,
    bytes: Vec<u8>,
}

fn parse<R: Form>(block: &Block) -> (Vec<Entry<R>>, Scan) {
    let mut entries = Vec::new();
    let scan = scan_lines(block.bytes.as_slice(), block.from, |line: Line<'_, R>| {
        entries.push(line.entry);
        Ok(())
    });
    (entries, scan.expect("memory can be read"))
}

/// A log cut into blocks.
struct Blocks<F> {
    reader: F,
    block_bytes: usize,
    /// Read already: the beginning of a line, and no end.
    rest: Vec<u8>,
    /// Where that begins.
    place: Place,
    ended: bool,
}

impl<F: Read> Blocks<F> {
    /// The next block; only the last one can end without a line end.
    fn next(&mut self) -> io::Result<Option<Block>> {
        let mut bytes = std::mem::take(&mut self.rest);
        while !self.ended {
            let before = bytes.len();
            bytes.reserve(self.block_bytes);
            let read = self.reader.by_ref().take(self.block_bytes as u64).read_to_end(&mut bytes)?;
            self.ended = read < self.block_bytes;
            if let Some(place) = bytes[before..].iter().rposition(|b| *b == b'\n') {
                self.rest = bytes.split_off(before + place + 1);
                break;
            }
        }
        if bytes.is_empty() {
            return Ok(None);
        }
        let from = self.place;
        self.place.bytes += bytes.len() as u64;
        self.place.lines += bytes.iter().filter(|b| **b == b'\n').count() as u64;
        Ok(Some(Block { from, bytes }))
    }
}

#[cfg(test)]
mod tests {
    use super::super::log::{Record, line};
    use super::super::scan::scan;
    use super::super::tests::record;
    use super::*;
    use proptest::prelude::*;

    fn in_blocks(bytes: &[u8], block_bytes: usize, threads: usize) -> (Vec<Entry>, Scan) {
        let mut entries = Vec::new();
        let scan = scan_blocks::<Record>(bytes, block_bytes, threads, |entry| entries.push(entry));
        (entries, scan.unwrap())
    }

    fn line_by_line(bytes: &[u8]) -> (Vec<Entry>, Scan) {
        let mut entries = Vec::new();
        let scan = scan(bytes, Place::default(), |line: Line<'_, Record>| {
            entries.push(line.entry);
            Ok(())
        });
        (entries, scan.unwrap())
    }

    proptest! {
        /// Damaged or cut anywhere, in blocks shorter and longer than lines, by fewer and more threads than blocks.
        #[test]
        fn blocks_are_read_as_lines_are(
            sets in proptest::collection::vec((0_usize..20_000, prop_oneof![Just(0), Just(b'\n'), any::<u8>()]), 0..6),
            cut in 0_usize..20_000,
            block_bytes in 1_usize..5000,
            threads in 1_usize..6,
        ) {
            let lines: Vec<String> = (0..20).map(|index| line(&Entry::Outcome(record(index)))).collect();
            let mut bytes = lines.concat().into_bytes();
            for (place, byte) in sets {
                let length = bytes.len();
                bytes[place % length] = byte;
            }
            bytes.truncate(cut);
            prop_assert_eq!(in_blocks(&bytes, block_bytes, threads), line_by_line(&bytes));
        }
    }

    #[test]
    fn much_damage_is_counted_as_line_by_line() {
        let bytes = b"no line\n".repeat(1000);
        let read = in_blocks(&bytes, 100, 3);
        assert_eq!((read.1.damage.len(), read.1.more_damage), (100, 900));
        assert_eq!(read, line_by_line(&bytes));
    }
}
