//! The columns of a Parquet file.

use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;

use bytes::Bytes;
use parquet::basic::{Compression, ConvertedType, LogicalType, Repetition, TimeUnit, Type};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{DataType, DoubleType};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{ColumnDescriptor, Type as Schema};

use crate::column_map::ColumnMap;
use crate::error::DataError;
use crate::file::{file_name, write_bytes};
use crate::layout::{Field, Headers, Layout};
use crate::read_run::Raw;
use crate::run::{Mark, Run};

/// Reads the columns of a Parquet file that have known names or are named by a map: floating-point and whole numbers, times and
/// time stamps. What is null is NaN. Other columns may hold anything.
///
/// # Errors
/// If the file is broken or encrypted, names no run, or a column that is asked for holds no numbers.
pub(crate) fn read(file: &str, bytes: Vec<u8>, columns: Option<&ColumnMap>) -> Result<Raw, DataError> {
    let bad = |source| DataError::BadParquet { file: file.into(), source };
    let reader = sound(|| SerializedFileReader::new(Bytes::from(bytes))).map_err(bad)?;
    let schema = reader.metadata().file_metadata().schema_descr();
    let names: Vec<String> = schema.columns().iter().map(|column| column.path().string()).collect();
    let headers = Headers { file, place: file.into(), names: names.iter().map(String::as_str).collect() };
    let layout = Layout::new(&headers, columns)?;
    let fields = || std::iter::once(&layout.time).chain(layout.signals.iter().map(|(_, field)| field));
    let mut read: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    for index in fields().flat_map(Field::columns).collect::<BTreeSet<usize>>() {
        let of = schema.column(index);
        let Some(numbers) = Numbers::of(&of) else {
            let is_list = of.max_rep_level() > 0;
            let got = if is_list { "list".into() } else { of.physical_type().to_string().to_lowercase() };
            return Err(DataError::NoNumbers { file: file.into(), column: names[index].clone(), got });
        };
        let is_scaled = |field: &Field| field.is_scaled() && field.columns().any(|c| c == index);
        if matches!(numbers, Numbers::Seconds(_)) && fields().any(is_scaled) {
            return Err(DataError::ScaledTime { file: file.into(), column: names[index].clone() });
        }
        read.insert(index, sound(|| column(&reader, index, numbers)).map_err(bad)?);
    }
    let rows = read.values().map(Vec::len).min().unwrap_or(0);
    let values = |field: &Field| -> Result<Vec<f64>, DataError> {
        (0..rows).map(|row| field.number(|index| Ok(read[&index][row]))).collect()
    };
    let time = values(&layout.time)?;
    let signals = layout.signals.iter().map(|(_, field)| values(field)).collect::<Result<_, _>>()?;
    let run = layout.run(file, Mark::Row, (1..=rows as u64).collect(), time, signals);
    Ok(Raw { run, faults: Vec::new(), layout, names })
}

// The library takes for granted much of what a broken file says, and panics.
fn sound<T>(work: impl FnOnce() -> Result<T, ParquetError>) -> Result<T, ParquetError> {
    let broken = |_| Err(ParquetError::General("what it says of itself does not hold".to_owned()));
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(broken)
}

/// Writes a run as Parquet: a column of doubles for the time and each signal, packed with snappy. The file appears whole or not
/// at all.
///
/// # Errors
/// If the file cannot be written.
pub(crate) fn write(run: &Run, path: &Path) -> Result<(), DataError> {
    let packed = packed(run).map_err(|source| DataError::BadParquet { file: file_name(path), source })?;
    write_bytes(path, &packed)
}

fn packed(run: &Run) -> Result<Vec<u8>, ParquetError> {
    let names = std::iter::once("time".to_owned()).chain(run.signals.iter().map(|s| s.name().to_string()));
    let field = |name: String| {
        let field = Schema::primitive_type_builder(&name, Type::DOUBLE).with_repetition(Repetition::REQUIRED);
        field.build().map(Arc::new)
    };
    let fields = names.map(field).collect::<Result<_, _>>()?;
    let schema = Schema::group_type_builder("run").with_fields(fields).build()?;
    let packing = WriterProperties::builder().set_compression(Compression::SNAPPY).build();
    let mut file = SerializedFileWriter::new(Vec::new(), Arc::new(schema), Arc::new(packing))?;
    let mut rows = file.next_row_group()?;
    for values in std::iter::once(&run.time).chain(run.signals.iter().map(|s| &s.values)) {
        let Some(mut column) = rows.next_column()? else { break };
        column.typed::<DoubleType>().write_batch(values, None, None)?;
        column.close()?;
    }
    rows.close()?;
    file.into_inner()
}

/// What the numbers of a column mean.
#[derive(Clone, Copy)]
enum Numbers {
    Signed,
    /// Never negative, in these bits.
    Unsigned(u64),
    /// Seconds in one of them, counted from the first that is there: no date matters, and their differences keep all digits.
    Seconds(f64),
}

impl Numbers {
    // None of a column that holds other things than one number a row.
    fn of(column: &ColumnDescriptor) -> Option<Self> {
        if column.max_rep_level() > 0 {
            return None;
        }
        let seconds = |unit: &TimeUnit| match unit {
            TimeUnit::MILLIS => 1e-3,
            TimeUnit::MICROS => 1e-6,
            TimeUnit::NANOS => 1e-9,
        };
        match column.physical_type() {
            Type::FLOAT | Type::DOUBLE => return Some(Self::Signed),
            Type::INT32 | Type::INT64 => {}
            _ => return None,
        }
        match (column.logical_type_ref(), column.converted_type()) {
            (Some(LogicalType::Timestamp(of) | LogicalType::Time(of)), _) => {
                Some(Self::Seconds(seconds(&of.unit)))
            }
            (_, ConvertedType::TIMESTAMP_MILLIS | ConvertedType::TIME_MILLIS) => Some(Self::Seconds(1e-3)),
            (_, ConvertedType::TIMESTAMP_MICROS | ConvertedType::TIME_MICROS) => Some(Self::Seconds(1e-6)),
            (_, ConvertedType::DECIMAL | ConvertedType::DATE) => None,
            (_, ConvertedType::UINT_32) => Some(Self::Unsigned(u64::from(u32::MAX))),
            (_, ConvertedType::UINT_64) => Some(Self::Unsigned(u64::MAX)),
            _ => Some(Self::Signed),
        }
    }

    fn of_whole(self, values: Vec<Option<i64>>) -> Vec<f64> {
        let first = values.iter().flatten().next().copied().unwrap_or(0);
        let number = |x: i64| match self {
            Self::Signed => x as f64,
            Self::Unsigned(mask) => (x as u64 & mask) as f64,
            Self::Seconds(scale) => x.wrapping_sub(first) as f64 * scale,
        };
        values.into_iter().map(|x| x.map_or(f64::NAN, number)).collect()
    }
}

// A column of the whole file, row group after row group.
fn column(
    reader: &SerializedFileReader<Bytes>,
    index: usize,
    numbers: Numbers,
) -> Result<Vec<f64>, ParquetError> {
    let (mut whole, mut real) = (Vec::new(), Vec::new());
    for group in 0..reader.num_row_groups() {
        let group = reader.get_row_group(group)?;
        let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
        let present = group.metadata().column(index).column_descr().max_def_level();
        match group.get_column_reader(index)? {
            ColumnReader::Int32ColumnReader(of) => {
                whole.extend(values(of, rows, present)?.into_iter().map(|x| x.map(i64::from)));
            }
            ColumnReader::Int64ColumnReader(of) => whole.extend(values(of, rows, present)?),
            ColumnReader::FloatColumnReader(of) => {
                real.extend(values(of, rows, present)?.into_iter().map(|x| x.map_or(f64::NAN, f64::from)));
            }
            ColumnReader::DoubleColumnReader(of) => {
                real.extend(values(of, rows, present)?.into_iter().map(|x| x.unwrap_or(f64::NAN)));
            }
            _ => return Err(ParquetError::General("a column changes its type".to_owned())),
        }
    }
    real.extend(numbers.of_whole(whole));
    Ok(real)
}

// The values of one row group, none where they are null: where less than `present` levels of a column are defined.
fn values<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    rows: usize,
    present: i16,
) -> Result<Vec<Option<T::T>>, ParquetError> {
    let (mut values, mut levels, mut done) = (Vec::new(), Vec::new(), 0);
    while done < rows {
        let (records, ..) = reader.read_records(rows - done, Some(&mut levels), None, &mut values)?;
        if records == 0 {
            return Err(ParquetError::General(format!("a column ends after {done} of {rows} rows")));
        }
        done += records;
    }
    let mut values = values.into_iter();
    if present == 0 {
        return Ok(values.map(Some).collect());
    }
    Ok(levels.into_iter().map(|level| if level == present { values.next() } else { None }).collect())
}
