//! What the elements of a written file hold: names and types of the numbers in a row, and the rows
//! themselves, packed as in the file.

use super::Kind;

/// The numbers in every row of one element, in their order in the file.
#[derive(Clone, Debug, PartialEq)]
pub struct Columns {
    pub(super) element: &'static str,
    properties: Vec<(Kind, String)>,
    triangles: bool,
}

impl Columns {
    /// Of an element: `vertex` is what viewers show.
    pub fn new(element: &'static str) -> Self {
        Self { element, properties: Vec::new(), triangles: false }
    }
    /// Element `face`: a list of three vertices in every row.
    pub fn triangles() -> Self {
        Self { triangles: true, ..Self::new("face") }
    }
    /// Followed by 32-bit floats.
    #[must_use]
    pub fn floats<N: Into<String>>(self, names: impl IntoIterator<Item = N>) -> Self {
        self.with(Kind::F32, names)
    }
    /// Followed by unsigned 32-bit integers.
    #[must_use]
    pub fn integers<N: Into<String>>(self, names: impl IntoIterator<Item = N>) -> Self {
        self.with(Kind::U32, names)
    }
    /// Followed by bytes.
    #[must_use]
    pub fn bytes<N: Into<String>>(self, names: impl IntoIterator<Item = N>) -> Self {
        self.with(Kind::U8, names)
    }

    fn with<N: Into<String>>(mut self, kind: Kind, names: impl IntoIterator<Item = N>) -> Self {
        self.properties.extend(names.into_iter().map(|name| (kind, name.into())));
        self
    }

    /// Bytes of a row.
    pub fn row(&self) -> usize {
        let list = if self.triangles { 1 + 3 * size_of::<u32>() } else { 0 };
        list + self.properties.iter().map(|(kind, _)| kind.size()).sum::<usize>()
    }

    /// Number of floats at the head of a row.
    pub fn leading_floats(&self) -> usize {
        self.properties.iter().take_while(|(kind, _)| *kind == Kind::F32).count()
    }

    /// Lines of the header for so many rows.
    pub(super) fn header(&self, rows: usize) -> String {
        let property = |(kind, name): &(Kind, String)| format!("property {} {name}\n", kind.name());
        let properties: String = self.properties.iter().map(property).collect();
        let list = if self.triangles {
            "property list uchar int vertex_indices\n"
        } else {
            Default::default()
        };
        format!("element {} {rows}\n{properties}{list}", self.element)
    }

    /// True for an element of a file that has these columns and no others.
    pub(super) fn are_of(&self, element: &super::Element) -> bool {
        let found = element.properties.iter().map(|p| (p.kind, p.name.as_str()));
        self.element == element.name
            && !element.has_lists
            && found.eq(self.properties.iter().map(|(kind, name)| (*kind, name.as_str())))
    }
}

/// Rows of one element as they stand in the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rows(pub(super) Vec<u8>);

impl Rows {
    /// Adds one row: floats, then the bytes of what follows them.
    pub fn push(&mut self, floats: impl IntoIterator<Item = f32>, rest: &[u8]) {
        floats.into_iter().for_each(|v| self.0.extend(v.to_le_bytes()));
        self.0.extend(rest);
    }
    /// The rows of these columns: the floats at their head, and the bytes after them.
    pub fn iter(&self, columns: &Columns) -> impl Iterator<Item = (Vec<f32>, &[u8])> {
        let floats = size_of::<f32>() * columns.leading_floats();
        self.0.chunks_exact(columns.row()).map(move |row| {
            let (values, rest) = row.split_at(floats);
            let value = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
            (values.chunks_exact(size_of::<f32>()).map(value).collect(), rest)
        })
    }
}
