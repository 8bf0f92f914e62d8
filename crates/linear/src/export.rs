//! A linear model as the bytes of a NumPy or MATLAB file.

use std::io::{Cursor, Write};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use crate::StateSpace;

/// What both files hold, by name.
enum Entry<'a> {
    Matrix(&'a faer::Mat<f64>),
    Column(&'a [f64]),
    Number(f64),
    Names(&'a [String]),
}

fn entries(linear: &StateSpace) -> [(&'static str, Entry<'_>); 10] {
    [
        ("A", Entry::Matrix(&linear.A)),
        ("B", Entry::Matrix(&linear.B)),
        ("C", Entry::Matrix(&linear.C)),
        ("D", Entry::Matrix(&linear.D)),
        // Zero means continuous time, for python-control as for MATLAB.
        ("dt", Entry::Number(linear.sample_time.unwrap_or(0.0))),
        ("states", Entry::Names(&linear.states)),
        ("inputs", Entry::Names(&linear.inputs)),
        ("outputs", Entry::Names(&linear.outputs)),
        ("input_delay", Entry::Column(&linear.input_delay)),
        ("output_delay", Entry::Column(&linear.output_delay)),
    ]
}

impl StateSpace {
    /// The bytes of a NumPy archive (`.npz`): `A`, `B`, `C`, `D`, `dt` (0 for continuous time), `states`, `inputs`,
    /// `outputs`, `input_delay`, `output_delay`. The same system gives the same bytes.
    ///
    /// ```text
    /// m = numpy.load("model.npz");  sys = control.ss(m["A"], m["B"], m["C"], m["D"], float(m["dt"]))
    /// ```
    pub fn to_npz(&self) -> Vec<u8> {
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .last_modified_time(DateTime::default());
        let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
        for (name, entry) in entries(self) {
            let bytes = npy(&entry);
            let written = archive
                .start_file(format!("{name}.npy"), options)
                .and_then(|()| Ok(archive.write_all(&bytes)?));
            written.expect("bytes in memory, each far below 4 GiB, are always written");
        }
        archive.finish().expect("bytes in memory are always written").into_inner()
    }

    /// The bytes of a MATLAB file (`.mat`, level 5), with the same variables as [`StateSpace::to_npz`]; names are
    /// cell arrays.
    ///
    /// ```text
    /// m = load('model.mat');  sys = ss(m.A, m.B, m.C, m.D, m.dt, 'StateName', m.states)
    /// ```
    pub fn to_mat(&self) -> Vec<u8> {
        let mut file = format!("{:<124}", "MATLAB 5.0 MAT-file, written by Sinew").into_bytes();
        file.extend(0x0100u16.to_le_bytes());
        file.extend(*b"IM");
        for (name, entry) in entries(self) {
            file.extend(mat_array(name, &entry));
        }
        file
    }
}

// One array of NumPy's format 1.0, rows first.
fn npy(entry: &Entry) -> Vec<u8> {
    let (kind, shape, data): (String, String, Vec<u8>) = match entry {
        Entry::Matrix(m) => {
            let numbers = (0..m.nrows()).flat_map(|i| (0..m.ncols()).map(move |j| m[(i, j)]));
            (
                "<f8".into(),
                format!("({}, {})", m.nrows(), m.ncols()),
                numbers.flat_map(f64::to_le_bytes).collect(),
            )
        }
        Entry::Column(c) => {
            ("<f8".into(), format!("({},)", c.len()), c.iter().flat_map(|x| x.to_le_bytes()).collect())
        }
        Entry::Number(x) => ("<f8".into(), "()".into(), x.to_le_bytes().to_vec()),
        Entry::Names(names) => {
            let width = names.iter().map(|n| n.chars().count()).max().unwrap_or(0).max(1);
            let padded = |n: &String| -> Vec<u8> {
                let letters = n.chars().map(u32::from).chain(std::iter::repeat(0)).take(width);
                letters.flat_map(u32::to_le_bytes).collect()
            };
            (format!("<U{width}"), format!("({},)", names.len()), names.iter().flat_map(padded).collect())
        }
    };
    let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    // Magic, version, length, header and a line feed fill whole 64 bytes.
    let length = (10 + header.len() + 1).div_ceil(64) * 64 - 10;
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((length as u16).to_le_bytes());
    bytes.extend(format!("{header:<0$}\n", length - 1).into_bytes());
    bytes.extend(data);
    bytes
}

// Types of elements and classes of arrays, by the format's numbers.
const INT8: u32 = 1;
const UINT16: u32 = 4;
const INT32: u32 = 5;
const UINT32: u32 = 6;
const DOUBLE: u32 = 9;
const MATRIX: u32 = 14;
const CELL_CLASS: u32 = 1;
const CHAR_CLASS: u32 = 4;
const DOUBLE_CLASS: u32 = 6;

fn mat_array(name: &str, entry: &Entry) -> Vec<u8> {
    match entry {
        Entry::Matrix(m) => {
            let numbers = (0..m.ncols()).flat_map(|j| (0..m.nrows()).map(move |i| m[(i, j)]));
            doubles(name, m.nrows(), m.ncols(), numbers)
        }
        Entry::Column(c) => doubles(name, c.len(), 1, c.iter().copied()),
        Entry::Number(x) => doubles(name, 1, 1, std::iter::once(*x)),
        Entry::Names(names) => {
            let text = |n: &String| {
                let letters: Vec<u16> = n.encode_utf16().collect();
                let bytes = letters.iter().flat_map(|c| c.to_le_bytes()).collect::<Vec<u8>>();
                array("", CHAR_CLASS, 1, letters.len(), &element(UINT16, &bytes))
            };
            let cells: Vec<u8> = names.iter().flat_map(text).collect();
            array(name, CELL_CLASS, names.len(), 1, &cells)
        }
    }
}

fn doubles(name: &str, rows: usize, columns: usize, numbers: impl Iterator<Item = f64>) -> Vec<u8> {
    let bytes: Vec<u8> = numbers.flat_map(f64::to_le_bytes).collect();
    array(name, DOUBLE_CLASS, rows, columns, &element(DOUBLE, &bytes))
}

// Flags, dimensions, name, data.
fn array(name: &str, class: u32, rows: usize, columns: usize, data: &[u8]) -> Vec<u8> {
    let flags = [class.to_le_bytes(), 0u32.to_le_bytes()].concat();
    let dimensions = [(rows as i32).to_le_bytes(), (columns as i32).to_le_bytes()].concat();
    let parts =
        [element(UINT32, &flags), element(INT32, &dimensions), element(INT8, name.as_bytes()), data.to_vec()];
    element(MATRIX, &parts.concat())
}

// A tag of type and length, then the data, filled to whole 8 bytes.
fn element(kind: u32, data: &[u8]) -> Vec<u8> {
    let mut bytes = [kind.to_le_bytes(), (data.len() as u32).to_le_bytes()].concat();
    bytes.extend(data);
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes
}
