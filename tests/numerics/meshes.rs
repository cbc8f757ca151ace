//! Edges, vertices, faces that coincide, triangles without an area, slivers, and very many triangles.
