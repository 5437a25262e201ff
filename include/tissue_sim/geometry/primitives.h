#pragma once

#include "tissue_sim/geometry/triangle_mesh.h"

namespace tissue_sim {

/// A closed UV sphere around the origin with its poles on the z axis: 2 n (n - 1) triangles and n (n - 1) + 2
/// vertices for n slices and n stacks. `radius` in metres; n >= 3.
TriangleMesh make_sphere(double radius, int n);

/// A closed cylinder around the z axis, z from -length/2 to +length/2, its caps fanned around a centre vertex.
/// `segments` corners around; 3 or more.
TriangleMesh make_cylinder(double radius, double length, int segments);

/// A closed box around the origin. `size` in metres along x, y and z.
TriangleMesh make_box(const Vector3& size);

}  // namespace tissue_sim
