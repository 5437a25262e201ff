#include "tissue_sim/tissue/rest_shape.h"

#include <gtest/gtest.h>

#include <functional>

#include "geometry/twins.h"
#include "tissue_sim/geometry/primitives.h"
#include "tissue_sim/tissue/material.h"

namespace tissue_sim::rest_shape_test {
namespace {

constexpr double pi = 3.14159265358979323846;
constexpr double thickness = 0.002;

Organ wall_of(const TriangleMesh& mesh, double poisson = 0.45) {
  Organ organ;
  organ.mesh = mesh;
  organ.model = Model::surface;
  organ.material.young = 10e3;
  organ.material.poisson = poisson;
  organ.material.density = 1060.0;
  organ.material.damping = 0.1;
  organ.wall_thickness = thickness;
  return organ;
}

/// A closed slab with n by n cells of equilateral triangles of side `edge` above and below.
TriangleMesh lattice_slab(int n, double edge) {
  TriangleMesh mesh;
  const auto at = [n](int layer, int i, int j) { return (layer * (n + 1) + i) * (n + 1) + j; };
  for (int layer = 0; layer < 2; ++layer) {
    for (int i = 0; i <= n; ++i) {
      for (int j = 0; j <= n; ++j)
        mesh.vertices.emplace_back(edge * (i + 0.5 * j), edge * std::sqrt(0.75) * j, edge * layer);
    }
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      mesh.triangles.push_back({at(1, i, j), at(1, i + 1, j), at(1, i, j + 1)});
      mesh.triangles.push_back({at(1, i + 1, j), at(1, i + 1, j + 1), at(1, i, j + 1)});
      mesh.triangles.push_back({at(0, i, j), at(0, i, j + 1), at(0, i + 1, j)});
      mesh.triangles.push_back({at(0, i + 1, j), at(0, i, j + 1), at(0, i + 1, j + 1)});
    }
    const auto side = [&](int a, int b, int above_a, int above_b) {
      mesh.triangles.push_back({a, b, above_b});
      mesh.triangles.push_back({a, above_b, above_a});
    };
    side(at(0, i, 0), at(0, i + 1, 0), at(1, i, 0), at(1, i + 1, 0));
    side(at(0, i + 1, n), at(0, i, n), at(1, i + 1, n), at(1, i, n));
    side(at(0, n, i), at(0, n, i + 1), at(1, n, i), at(1, n, i + 1));
    side(at(0, 0, i + 1), at(0, 0, i), at(1, 0, i + 1), at(1, 0, i));
  }
  return mesh;
}

template <class Kind>
double energy_where(const std::vector<Kind>& elements, const std::vector<Vector3>& positions,
                    const std::function<bool(const Kind&)>& counted) {
  ElementVectors<Kind> gradient;
  double energy = 0.0;
  for (const Kind& element : elements) {
    if (!counted(element)) continue;
    const double c = element.evaluate(gather(element, positions), gradient);
    energy += 0.5 * element.stiffness * c * c;
  }
  return energy;
}

template <class Kind>
double energy(const std::vector<Kind>& elements, const std::vector<Vector3>& positions) {
  return energy_where<Kind>(elements, positions, [](const Kind&) { return true; });
}

/// The upper face of a slab, far from its rim: one cell of the lattice has one edge in each of three directions and two
/// triangles.
class Lattice : public testing::Test {
 protected:
  static constexpr int n = 8;
  static constexpr double edge = 0.002;
  static constexpr double cell_area = edge * edge * 0.8660254037844386;

  int at(int i, int j) const { return ((n + 1) + i) * (n + 1) + j; }

  bool in_cell(int a, int b) const {
    const int o = at(4, 4);
    const std::array<std::array<int, 2>, 3> edges = {{{o, at(5, 4)}, {o, at(4, 5)}, {at(5, 4), at(4, 5)}}};
    return std::any_of(edges.begin(), edges.end(),
                       [&](const auto& e) { return (e[0] == a && e[1] == b) || (e[0] == b && e[1] == a); });
  }

  double stretching(const RestShape& shape, const std::function<Vector3(const Vector3&)>& map) const {
    std::vector<Vector3> x;
    for (const Vector3& p : shape.positions) x.push_back(map(p));
    const int o = at(4, 4);
    const double of_edges = energy_where<DistanceElement>(
        shape.distances, x, [&](const DistanceElement& e) { return in_cell(e.vertices[0], e.vertices[1]); });
    const double of_triangles = energy_where<AreaElement>(shape.areas, x, [&](const AreaElement& e) {
      return (e.vertices[0] == o && e.vertices[1] == at(5, 4)) ||
             (e.vertices[0] == at(5, 4) && e.vertices[1] == at(5, 5));
    });
    return (of_edges + of_triangles) / cell_area;
  }

  double bending(const RestShape& shape, const std::function<Vector3(const Vector3&)>& map) const {
    std::vector<Vector3> x;
    for (const Vector3& p : shape.positions) x.push_back(map(p));
    return energy_where<VolumeElement>(shape.volumes, x,
                                       [&](const VolumeElement& e) { return in_cell(e.vertices[0], e.vertices[1]); }) /
           cell_area;
  }

  TriangleMesh mesh = lattice_slab(n, edge);
};

TEST_F(Lattice, IsAClosedSurface) {
  EXPECT_TRUE(inspect(mesh).closed_manifold());
}

TEST_F(Lattice, StretchesWithYoungsModulusAndPoissonsRatio) {
  constexpr double strain = 1e-4;
  for (const double nu : {1.0 / 3.0, 0.4, 0.45}) {
    const RestShape shape = build_rest_shape(wall_of(mesh, nu));
    for (const double heading : {0.0, 0.3, pi / 6.0, 1.2}) {
      // W(e1, e2) = 1/2 (A e1^2 + 2 B e1 e2 + A e2^2) along two normal directions; without stress across, E h = A - B^2
      // / A.
      const Vector3 u(std::cos(heading), std::sin(heading), 0.0);
      const Vector3 v(-u.y(), u.x(), 0.0);
      const auto energy_at = [&](double e1, double e2) {
        return stretching(shape, [&](const Vector3& p) { return Vector3(p + e1 * u.dot(p) * u + e2 * v.dot(p) * v); });
      };
      const double along = 2.0 * energy_at(strain, 0.0) / (strain * strain);
      const double across = 2.0 * energy_at(0.0, strain) / (strain * strain);
      const double both = energy_at(strain, strain) / (strain * strain) - 0.5 * (along + across);
      EXPECT_NEAR((along - both * both / across) / (10e3 * thickness), 1.0, 0.01);  // measured: 1.000
      EXPECT_NEAR(both / across, nu, 0.01);
    }
  }
}

TEST_F(Lattice, BendsAsAPlate) {
  // 1/2 D / R^2 on a cylinder, across the rows and along them.
  const RestShape shape = build_rest_shape(wall_of(mesh));
  const double plate = wall_stiffness(wall_of(mesh).material, thickness).bending;
  constexpr double radius = 0.2;
  const double per_area = 0.5 * plate / (radius * radius);
  const auto rolled = [](double along) {
    return Vector3(radius * std::sin(along / radius), 0.0, radius * std::cos(along / radius));
  };
  const double in_x =
      bending(shape, [&](const Vector3& p) { return Vector3(rolled(p.x()) + p.y() * Vector3::UnitY()); });
  const double in_y =
      bending(shape, [&](const Vector3& p) { return Vector3(rolled(p.y()) + p.x() * Vector3::UnitY()); });
  EXPECT_NEAR(in_x / per_area, 1.0, 0.01);  // measured: 1.0000
  EXPECT_NEAR(in_y / per_area, 1.0, 0.01);
}

TEST(RestShape, ASphereBlownUpStoresTheEnergyOfAMembrane) {
  // E h / (1 - nu) strain^2 an area; its content takes ten times that.
  constexpr double strain = 1e-4;
  for (const TriangleMesh& mesh : {make_octasphere(0.05, 4), make_sphere(0.05, 32)}) {
    const RestShape shape = build_rest_shape(wall_of(mesh));
    std::vector<Vector3> x = shape.positions;
    for (Vector3& p : x) p *= 1.0 + strain;
    const double membrane = 4.0 * pi * 0.05 * 0.05 * 10e3 * thickness / (1.0 - 0.45) * strain * strain;
    EXPECT_NEAR((energy(shape.distances, x) + energy(shape.areas, x)) / membrane, 1.0, 0.03);  // measured: 0.997, 0.987
    EXPECT_LT(energy(shape.volumes, x), 0.01 * membrane);

    std::vector<Vector3> gradient(x.size());
    const double c = shape.enclosed.evaluate(x, shape.triangles, gradient);
    EXPECT_NEAR(0.5 * shape.enclosed.stiffness * c * c / membrane, 10.0, 0.3);
  }
}

TEST(RestShape, ASphereWeighsWhatItsWallWeighs) {
  const RestShape shape = build_rest_shape(wall_of(make_octasphere(0.05, 4)));
  const double wall = 1060.0 * thickness * 4.0 * pi * 0.05 * 0.05;
  EXPECT_NEAR((shape.total_mass - shape.added_mass) / wall, 1.0, 0.005);  // inscribed: a little less area
  double sum = 0.0;
  for (const double m : shape.mass) sum += m;
  EXPECT_NEAR(sum, shape.total_mass, 1e-12 * sum);
  for (std::size_t v = 0; v < shape.mass.size(); ++v) EXPECT_DOUBLE_EQ(shape.mass[v] * shape.inverse_mass[v], 1.0);
}

TEST(RestShape, RestsWithoutEnergy) {
  const RestShape shape = build_rest_shape(wall_of(make_torus(0.05, 0.02, 12)));
  EXPECT_EQ(energy(shape.distances, shape.positions), 0.0);
  EXPECT_EQ(energy(shape.areas, shape.positions), 0.0);
  EXPECT_EQ(energy(shape.volumes, shape.positions), 0.0);
  std::vector<Vector3> gradient(shape.positions.size());
  EXPECT_NEAR(shape.enclosed.evaluate(shape.positions, shape.triangles, gradient), 0.0, 1e-13);
}

TEST(RestShape, FlatFacesGiveFiniteFlaps) {
  // On a gridded box most flaps have no volume at all, by which Eq. 8 divides.
  const RestShape shape = build_rest_shape(wall_of(make_grid_box({0.04, 0.05, 0.06}, 4)));
  ASSERT_EQ(shape.volumes.size(), shape.topology.edges.size());
  std::size_t flat = 0;
  for (const VolumeElement& flap : shape.volumes) {
    flat += std::abs(flap.rest) < 1e-18 ? 1 : 0;
    EXPECT_GT(flap.scale, 0.0);
    EXPECT_TRUE(std::isfinite(flap.stiffness) && std::isfinite(flap.damping));
    EXPECT_GT(flap.stiffness, 0.0);
  }
  EXPECT_GT(flat, shape.volumes.size() / 2);
}

TEST(RestShape, ShortEdgesAndSmallTrianglesAreFloored) {
  // The poles of a UV sphere are where its edges are short.
  const RestShape shape = build_rest_shape(wall_of(make_sphere(0.05, 32)));
  double mean_area = 0.0;
  for (const AreaElement& e : shape.areas) mean_area += e.rest / static_cast<double>(shape.areas.size());
  for (const DistanceElement& e : shape.distances) EXPECT_EQ(e.scale, std::max(e.rest, 0.5 * shape.mean_edge));
  for (const AreaElement& e : shape.areas) EXPECT_NEAR(e.scale, std::max(e.rest, 0.25 * mean_area), 1e-15);
}

TEST(RestShape, AttachedVerticesDoNotMove) {
  Organ organ = wall_of(make_octasphere(0.05, 2));
  organ.attached = {0, 7};
  const RestShape shape = build_rest_shape(organ);
  for (std::size_t v = 0; v < shape.mass.size(); ++v) EXPECT_EQ(shape.inverse_mass[v] == 0.0, v == 0 || v == 7);
}

TEST(RestShape, ContactOnlyPaysForNoElements) {
  Organ organ = wall_of(make_octasphere(0.05, 2));
  organ.model = Model::contact_only;
  const RestShape shape = build_rest_shape(organ);
  EXPECT_FALSE(shape.elastic());
  EXPECT_TRUE(shape.areas.empty() && shape.volumes.empty());
  EXPECT_EQ(shape.stable_substep, 0.0);
  for (const double m : shape.inverse_mass) EXPECT_EQ(m, 1.0);
}

TEST(RestShape, NamesOneVertexOfEachSurface) {
  TriangleMesh two = make_octasphere(0.01, 1);
  const int first_of_second = static_cast<int>(two.vertices.size());
  const TriangleMesh other = moved(two, {Vector3(0.05, 0, 0), Eigen::Quaterniond::Identity()});
  two.vertices.insert(two.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (const auto& [a, b, c] : other.triangles) {
    two.triangles.push_back({a + first_of_second, b + first_of_second, c + first_of_second});
  }
  EXPECT_EQ(build_rest_shape(wall_of(two)).component_roots, (std::vector<int>{0, first_of_second}));
}

}  // namespace
}  // namespace tissue_sim::rest_shape_test
