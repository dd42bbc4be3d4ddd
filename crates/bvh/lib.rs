//! WHERE things are: obvhs builds, this lays the nodes out as uploaded
