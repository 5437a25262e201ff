#include "tissue_sim/study/reference.h"

#include <omp.h>

#include <Eigen/CholmodSupport>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace tissue_sim {

namespace {

using Vectors = std::vector<Vector3>;
using SparseMatrix = Eigen::SparseMatrix<double>;

constexpr double armijo = 1e-4;             ///< 1, of the decrease that the slope promises
constexpr double energy_rounding = 1e-15;   ///< 1, of the shear modulus times volume: a smaller rise says nothing
constexpr int halvings = 30;                ///< of a Newton step before it is taken as it is
constexpr int free_changes = 4;             ///< a vertex that was let go more often waits until the others are at rest
constexpr double length_rounding = 1e-12;   ///< 1, of the solid's size: nearer is there
constexpr double least_reaction = 1e-8;     ///< 1, of the shear modulus times the square of the solid's size
constexpr int patience = 10;                ///< iterations without getting nearer, as where rounding is reached
constexpr double loose = 1e-3;              ///< 1, tolerance of the load steps before the last
constexpr double near = 1e-3;               ///< 1, of the solid's size: so near to the obstacle a start touches it
constexpr double smallest_step = 1.0 / 64;  ///< 1, of a load step: how far it is halved where Newton fails
constexpr double grazing = 0.1;             ///< 1, of a contact's direction along the free axes; less can push nothing

/// The lower triangle of a symmetric matrix of 3 x 3 blocks, a block for every two vertices that share a tetrahedron.
struct BlockMatrix {
  FlatLists columns;                          ///< a vertex: itself, then its neighbours of higher index, ascending
  std::vector<Matrix3> blocks;                ///< one an item of the columns
  std::vector<std::array<int, 10>> elements;  ///< a tetrahedron: the block of each of its pairs (see corner_pairs)
};

constexpr std::array<std::array<std::size_t, 2>, 10> corner_pairs = {
    {{0, 0}, {1, 1}, {2, 2}, {3, 3}, {0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};

BlockMatrix build_blocks(int vertex_count, const std::vector<Tetrahedron>& tetrahedra) {
  std::vector<std::vector<int>> columns(static_cast<std::size_t>(vertex_count));
  for (int v = 0; v < vertex_count; ++v) columns[static_cast<std::size_t>(v)].push_back(v);
  for (const Tetrahedron& corners : tetrahedra) {
    for (const auto& [i, j] : corner_pairs) {
      if (i == j) continue;
      columns[static_cast<std::size_t>(std::min(corners[i], corners[j]))].push_back(std::max(corners[i], corners[j]));
    }
  }
  BlockMatrix result;
  result.columns.first.push_back(0);
  for (std::vector<int>& column : columns) {
    std::sort(column.begin(), column.end());
    column.erase(std::unique(column.begin(), column.end()), column.end());
    result.columns.items.insert(result.columns.items.end(), column.begin(), column.end());
    result.columns.first.push_back(static_cast<int>(result.columns.items.size()));
  }
  result.blocks.resize(result.columns.items.size());
  for (const Tetrahedron& corners : tetrahedra) {
    std::array<int, 10> places{};
    for (std::size_t pair = 0; pair < corner_pairs.size(); ++pair) {
      const auto [i, j] = corner_pairs[pair];
      const int column = std::min(corners[i], corners[j]);
      const int* end = result.columns.end(column);
      const int* found = std::lower_bound(result.columns.begin(column), end, std::max(corners[i], corners[j]));
      places[pair] = static_cast<int>(found - result.columns.items.data());
    }
    result.elements.push_back(places);
  }
  return result;
}

/// The compressed columns of the scalar matrix; only its values change later.
SparseMatrix build_pattern(const BlockMatrix& matrix) {
  const auto n = static_cast<int>(matrix.columns.first.size()) - 1;
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(matrix.blocks.size() * 9);
  for (int column = 0; column < n; ++column) {
    for (const int* row = matrix.columns.begin(column); row != matrix.columns.end(column); ++row) {
      for (int b = 0; b < 3; ++b) {
        for (int a = *row == column ? b : 0; a < 3; ++a) entries.emplace_back(3 * *row + a, 3 * column + b, 1.0);
      }
    }
  }
  SparseMatrix result(3 * n, 3 * n);
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

/// The directions a vertex is held in: of three orthonormal ones, and how far it has yet to go along each.
struct Hold {
  Matrix3 frame = Matrix3::Identity();  ///< in its columns
  std::array<bool, 3> held{};
  Vector3 way{0, 0, 0};  ///< m, along the held ones
};

/// CHOLMOD starts threads for loops of a few microseconds, whatever the machine is busy with; on two busy cores that
/// took longer than the work.
class OneThread {
 public:
  OneThread() : before_(omp_get_max_active_levels()) { omp_set_max_active_levels(0); }
  ~OneThread() { omp_set_max_active_levels(before_); }
  OneThread(const OneThread&) = delete;
  OneThread& operator=(const OneThread&) = delete;

 private:
  int before_;
};

class Solver {
 public:
  Solver(const ReferenceProblem& given, const ReferenceOptions& given_options);
  ReferenceSolution solve();

 private:
  bool settle(double load, double tolerance);
  int inverted(const Vectors& positions) const;
  double evaluate(const Vectors& positions, double load, Vectors& gradient) const;
  ObstaclePoint obstacle_at(const Vector3& x, double load) const;
  Vector3 along_free(int vertex, const Vector3& direction) const;
  Hold hold(int vertex, double load) const;
  void touch(double load);
  void let_go(double load, const Vectors& gradient);
  void measure(const Vectors& gradient);
  void fill_blocks();
  bool factorise(Eigen::VectorXd& right);
  void fill_matrix(Eigen::VectorXd& right);
  Vectors moved(const Vectors& step, double part, double load) const;

  const ReferenceProblem& problem_;
  const ReferenceOptions& options_;
  int count_;
  double length_ = 0.0;    ///< m, of the solid's box
  double rounding_ = 0.0;  ///< J, of the energy
  double faintest_ = 0.0;  ///< N, the least reaction
  std::vector<NeoHookeanElement> elements_;
  std::vector<std::array<bool, 3>> fixed_;
  Vectors prescribed_;
  Vectors forces_;
  std::vector<int> surface_;
  BlockMatrix blocks_;
  SparseMatrix matrix_;
  Eigen::CholmodSupernodalLLT<SparseMatrix, Eigen::Lower> factor_;

  Vectors x_;
  std::vector<Hold> holds_;
  std::vector<char> touching_;
  std::vector<int> releases_;          ///< of a vertex, in this load step
  std::vector<ObstaclePoint> points_;  ///< of the touching vertices
  std::vector<double> pushes_;         ///< N, of the obstacle on them
  bool changed_ = false;               ///< the active set, in this iteration
  double left_over_ = 0.0;             ///< N
  double reaction_ = 0.0;              ///< N
  bool careful_ = false;               ///< there is a smaller load step to try
  int iterations_ = 0;
};

std::size_t at(int index) {
  return static_cast<std::size_t>(index);
}

void check_size(std::size_t size, std::size_t expected, const char* name) {
  if (size == 0 || size == expected) return;
  throw std::invalid_argument(std::string("ReferenceProblem: ") + name + " has " + std::to_string(size) +
                              " entries, expected none or " + std::to_string(expected));
}

Solver::Solver(const ReferenceProblem& given, const ReferenceOptions& given_options)
    : problem_(given), options_(given_options), count_(static_cast<int>(given.mesh.vertices.size())) {
  const std::vector<Tetrahedron>& tetrahedra = problem_.mesh.tetrahedra;
  const std::size_t n = at(count_);
  if (problem_.moduli.size() != 1 && problem_.moduli.size() != tetrahedra.size()) {
    throw std::invalid_argument("ReferenceProblem: moduli: expected one for all or one a tetrahedron");
  }
  check_size(problem_.fixed.size(), n, "fixed");
  check_size(problem_.prescribed.size(), n, "prescribed");
  check_size(problem_.forces.size(), n, "forces");
  check_size(options_.start.size(), n, "start");
  if (options_.load_steps < 1) throw std::invalid_argument("ReferenceOptions: load_steps: expected 1 or more");
  fixed_ = problem_.fixed;
  fixed_.resize(n);
  prescribed_ = problem_.prescribed;
  prescribed_.resize(n, Vector3::Zero());
  forces_ = problem_.forces;
  forces_.resize(n, Vector3::Zero());

  std::vector<char> used(n, 0);
  for (std::size_t t = 0; t < tetrahedra.size(); ++t) {
    NeoHookeanElement::Vectors corners;
    for (std::size_t i = 0; i < 4; ++i) {
      corners[i] = problem_.mesh.vertices[at(tetrahedra[t][i])];
      used[at(tetrahedra[t][i])] = 1;
    }
    elements_.push_back(
        NeoHookeanElement::at_rest(tetrahedra[t], corners, problem_.moduli[problem_.moduli.size() == 1 ? 0 : t]));
    rounding_ += energy_rounding * elements_.back().volume * elements_.back().moduli.mu;
    if (!(elements_.back().volume > 0.0)) {
      throw std::invalid_argument("ReferenceProblem: tetrahedron " + std::to_string(t) + " has no volume");
    }
  }
  Eigen::AlignedBox3d box;
  for (std::size_t v = 0; v < n; ++v) {
    if (used[v] == 0) fixed_[v] = {true, true, true};  // nothing would hold it
    box.extend(problem_.mesh.vertices[v]);
  }
  length_ = box.isEmpty() ? 0.0 : box.diagonal().norm();
  for (const NeoHookeanElement& element : elements_) {
    faintest_ = std::max(faintest_, least_reaction * element.moduli.mu * length_ * length_);
  }
  if (problem_.obstacle) {
    for (const int v : problem_.surface) {
      if (v < 0 || v >= count_) {
        throw std::invalid_argument("ReferenceProblem: surface names vertex " + std::to_string(v) + " of " +
                                    std::to_string(count_));
      }
      if (!(fixed_[at(v)][0] && fixed_[at(v)][1] && fixed_[at(v)][2])) surface_.push_back(v);
    }
  }
  x_ = options_.start.empty() ? problem_.mesh.vertices : options_.start;
  holds_.resize(n);
  touching_.assign(n, 0);
  releases_.assign(n, 0);
  points_.resize(n);
  pushes_.assign(n, 0.0);
  blocks_ = build_blocks(count_, tetrahedra);
  matrix_ = build_pattern(blocks_);
  factor_.cholmod().print = 0;  // a matrix that is not positive definite is expected, and met with a shift
  factor_.analyzePattern(matrix_);
}

/// Energy in J of the solid and its loads, and its gradient in N.
double Solver::evaluate(const Vectors& positions, double load, Vectors& gradient) const {
  double energy = 0.0;
  gradient.assign(at(count_), Vector3::Zero());
  for (const NeoHookeanElement& element : elements_) {
    NeoHookeanElement::Vectors corners;
    NeoHookeanElement::Vectors pull;
    for (std::size_t i = 0; i < 4; ++i) corners[i] = positions[at(element.vertices[i])];
    energy += element.evaluate(corners, pull);
    for (std::size_t i = 0; i < 4; ++i) gradient[at(element.vertices[i])] += pull[i];
  }
  for (std::size_t v = 0; v < at(count_); ++v) {
    energy -= load * forces_[v].dot(positions[v] - problem_.mesh.vertices[v]);
    gradient[v] -= load * forces_[v];
  }
  return energy;
}

ObstaclePoint Solver::obstacle_at(const Vector3& position, double load) const {
  return problem_.obstacle(position + (1.0 - load) * problem_.approach);
}

Vector3 Solver::along_free(int vertex, const Vector3& direction) const {
  Vector3 result = direction;
  for (int axis = 0; axis < 3; ++axis) {
    if (fixed_[at(vertex)][at(axis)]) result[axis] = 0.0;
  }
  return result;
}

Hold Solver::hold(int vertex, double load) const {
  const std::size_t v = at(vertex);
  Hold result;
  result.held = fixed_[v];
  const Vector3 goal = problem_.mesh.vertices[v] + load * prescribed_[v];
  int first_free = -1;
  int fixed_axis = -1;
  int free_axes = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (fixed_[v][at(axis)]) {
      result.way[axis] = goal[axis] - x_[v][axis];
      fixed_axis = axis;
    } else {
      if (first_free < 0) first_free = axis;
      ++free_axes;
    }
  }
  if (touching_[v] == 0) return result;
  const Vector3 push = along_free(vertex, points_[v].direction);
  const Vector3 normal = push.normalized();
  const double way = points_[v].depth / push.norm();
  if (free_axes == 1) {
    result.held = {true, true, true};
    result.way[first_free] = way * normal[first_free];
    return result;
  }
  const Vector3 beside = free_axes == 2 ? Vector3(Vector3::Unit(fixed_axis)) : normal.unitOrthogonal();
  const double fixed_way = free_axes == 2 ? result.way[fixed_axis] : 0.0;
  result.frame << normal, beside, normal.cross(beside);
  result.held = {true, free_axes == 2, false};
  result.way = Vector3(way, fixed_way, 0.0);
  return result;
}

/// Takes into the active set what is inside the obstacle.
void Solver::touch(double load) {
  for (const int vertex : surface_) {
    const std::size_t v = at(vertex);
    const ObstaclePoint point = obstacle_at(x_[v], load);
    if (touching_[v] == 0) {
      if (!(point.depth > length_rounding * length_)) continue;
      if (!(along_free(vertex, point.direction).norm() > grazing)) continue;
      touching_[v] = 1;
      changed_ = true;
    }
    points_[v] = point;
  }
}

/// Lets go what the obstacle would have to pull.
void Solver::let_go(double load, const Vectors& gradient) {
  const double slack = options_.tolerance * reaction_;
  int worst = -1;
  for (const int vertex : surface_) {
    const std::size_t v = at(vertex);
    const bool there = points_[v].depth <= length_rounding * length_;  // before that its push says nothing
    if (touching_[v] == 0 || !there || !(pushes_[v] < -slack)) continue;
    if (releases_[v] < free_changes) {
      ++releases_[v];
      touching_[v] = 0;
      changed_ = true;
    } else if (worst < 0 || pushes_[v] < pushes_[at(worst)]) {
      worst = vertex;
    }
  }
  // The others go one at a time, each from an equilibrium: so the energy falls from one to the next, and no set of
  // touching vertices comes again.
  if (worst >= 0 && !changed_ && left_over_ <= options_.tolerance * reaction_) {
    touching_[at(worst)] = 0;
    changed_ = true;
  }
  if (!changed_) return;
  for (const int vertex : surface_) holds_[at(vertex)] = hold(vertex, load);
  measure(gradient);
}

/// The forces left over, the reactions, and what each contact pushes with.
void Solver::measure(const Vectors& gradient) {
  double left = 0.0;
  double held = 0.0;
  for (std::size_t v = 0; v < at(count_); ++v) {
    const Vector3 local = holds_[v].frame.transpose() * gradient[v];
    for (int a = 0; a < 3; ++a) (holds_[v].held[at(a)] ? held : left) += local[a] * local[a];
    if (touching_[v] == 0) continue;
    const Vector3 push = along_free(static_cast<int>(v), points_[v].direction);
    pushes_[v] = push.dot(gradient[v]) / push.squaredNorm();
  }
  left_over_ = std::sqrt(left);
  reaction_ = std::max(std::sqrt(held), faintest_);
}

void Solver::fill_blocks() {
  for (Matrix3& block : blocks_.blocks) block.setZero();
  for (std::size_t t = 0; t < elements_.size(); ++t) {
    const NeoHookeanElement& element = elements_[t];
    NeoHookeanElement::Vectors corners;
    for (std::size_t i = 0; i < 4; ++i) corners[i] = x_[at(element.vertices[i])];
    for (std::size_t pair = 0; pair < corner_pairs.size(); ++pair) {
      const auto [i, j] = corner_pairs[pair];
      const bool lower = element.vertices[i] >= element.vertices[j];
      blocks_.blocks[at(blocks_.elements[t][pair])] +=
          lower ? element.block(corners, i, j) : element.block(corners, j, i);
    }
  }
  // On a curved obstacle the push turns as its vertex slides.
  for (const int vertex : surface_) {
    const std::size_t v = at(vertex);
    if (touching_[v] != 0) blocks_.blocks[at(blocks_.columns.first[v])] -= pushes_[v] * points_[v].turn;
  }
}

/// The matrix in the vertices' frames. What is held has a row of its own that says how far it goes; the others feel
/// that on the right-hand side.
void Solver::fill_matrix(Eigen::VectorXd& right) {
  double trace = 0.0;
  for (int v = 0; v < count_; ++v) trace += blocks_.blocks[at(blocks_.columns.first[at(v)])].trace();
  const double diagonal = trace / (3.0 * count_);
  double* values = matrix_.valuePtr();
  const int* starts = matrix_.outerIndexPtr();
  for (int column = 0; column < count_; ++column) {
    const Hold& from = holds_[at(column)];
    int below = 0;  // rows of this column's blocks so far
    for (const int* row = blocks_.columns.begin(column); row != blocks_.columns.end(column); ++row) {
      const Hold& to = holds_[at(*row)];
      const Matrix3 local =
          to.frame.transpose() * blocks_.blocks[at(static_cast<int>(row - blocks_.columns.items.data()))] * from.frame;
      const bool own = *row == column;
      for (int b = 0; b < 3; ++b) {
        for (int a = own ? b : 0; a < 3; ++a) {
          const bool a_held = to.held[at(a)];
          const bool b_held = from.held[at(b)];
          const int place = own ? starts[3 * column + b] + a - b : starts[3 * column + b] + below - b + a;
          values[place] = a_held || b_held ? 0.0 : local(a, b);
          if (own && a == b) {
            if (a_held) {
              values[place] = diagonal;
              right[3 * column + a] = diagonal * from.way[a];
            }
            continue;
          }
          if (b_held && !a_held) right[3 * *row + a] -= local(a, b) * from.way[b];
          if (a_held && !b_held) right[3 * column + b] -= local(a, b) * to.way[a];
        }
      }
      below += 3;
    }
  }
}

/// Cholesky; where the matrix is not positive definite, with the smallest of ten-folding shifts of its diagonal.
bool Solver::factorise(Eigen::VectorXd& right) {
  fill_blocks();
  fill_matrix(right);
  const double mean = matrix_.diagonal().sum() / static_cast<double>(matrix_.rows());
  double shift = 0.0;
  for (int attempt = 0; attempt < 12; ++attempt) {
    factor_.setShift(shift);
    factor_.factorize(matrix_);
    if (factor_.info() == Eigen::Success) return true;
    shift = shift > 0.0 ? 10.0 * shift : 1e-6 * mean;
  }
  return false;
}

/// `part` of a step, with what is held where it belongs.
Vectors Solver::moved(const Vectors& step, double part, double load) const {
  Vectors result(x_.size());
  for (std::size_t v = 0; v < x_.size(); ++v) {
    result[v] = x_[v] + part * step[v];
    for (int axis = 0; axis < 3; ++axis) {
      if (fixed_[v][at(axis)]) result[v][axis] = problem_.mesh.vertices[v][axis] + load * prescribed_[v][axis];
    }
    if (touching_[v] == 0) continue;
    for (int pass = 0; pass < 8; ++pass) {
      const ObstaclePoint point = obstacle_at(result[v], load);
      const Vector3 push = along_free(static_cast<int>(v), point.direction);
      if (!(push.norm() > grazing)) break;
      result[v] += point.depth / push.squaredNorm() * push;
      if (std::abs(point.depth) <= 0.01 * length_rounding * length_) break;
    }
  }
  return result;
}

int Solver::inverted(const Vectors& positions) const {
  int result = 0;
  for (const Tetrahedron& t : problem_.mesh.tetrahedra) {
    const double volume =
        tetrahedron_volume(positions[at(t[0])], positions[at(t[1])], positions[at(t[2])], positions[at(t[3])]);
    if (!(volume > 0.0)) ++result;
  }
  return result;
}

/// Newton at one load, from where the last one ended.
bool Solver::settle(double load, double tolerance) {
  std::fill(releases_.begin(), releases_.end(), 0);
  Vectors gradient;
  Vectors trial_gradient;
  Vectors step(at(count_));
  Eigen::VectorXd right(3 * count_);
  double least = 0.0;  // N, left over since the active set last changed
  int idle = 0;        // iterations since then that did not halve it
  for (int iteration = 0;; ++iteration) {
    changed_ = false;
    const double energy = evaluate(x_, load, gradient);
    touch(load);
    for (int v = 0; v < count_; ++v) holds_[at(v)] = hold(v, load);
    measure(gradient);
    let_go(load, gradient);
    double way = 0.0;
    for (std::size_t v = 0; v < at(count_); ++v) {
      for (int a = 0; a < 3; ++a) {
        if (holds_[v].held[at(a)]) way = std::max(way, std::abs(holds_[v].way[a]));
      }
    }
    const bool there = way <= length_rounding * length_;
    if (there && !changed_ && left_over_ <= tolerance * reaction_) return true;
    if (changed_ || !there || left_over_ < 0.5 * least) {
      least = left_over_;
      idle = 0;
    } else if (++idle == patience) {
      careful_ = false;
      return false;
    }
    if (iteration == options_.max_iterations || !std::isfinite(energy)) return false;

    for (int v = 0; v < count_; ++v) right.segment<3>(3 * v) = -(holds_[at(v)].frame.transpose() * gradient[at(v)]);
    if (!factorise(right)) return false;
    const Eigen::VectorXd solved = factor_.solve(right);
    double slope = 0.0;
    for (int v = 0; v < count_; ++v) {
      step[at(v)] = holds_[at(v)].frame * solved.segment<3>(3 * v);
      slope += gradient[at(v)].dot(step[at(v)]);
    }
    ++iterations_;
    // Where something has yet to go to its place the energy has to rise: such a step is taken whole.
    Vectors trial = moved(step, 1.0, load);
    if (!there && careful_ && inverted(trial) > inverted(x_)) return false;
    double part = 1.0;
    for (int halving = 0; there && halving < halvings; ++halving) {
      const double trial_energy = evaluate(trial, load, trial_gradient);
      if (trial_energy <= energy + armijo * part * slope + rounding_) break;
      part *= 0.5;
      trial = moved(step, part, load);
    }
    x_ = trial;
  }
}

ReferenceSolution Solver::solve() {
  ReferenceSolution result;
  if (!options_.start.empty()) {
    for (const int vertex : surface_) {
      const ObstaclePoint point = obstacle_at(x_[at(vertex)], 1.0 / options_.load_steps);
      const bool pushable = along_free(vertex, point.direction).norm() > grazing;
      if (pushable && point.depth > -near * length_) touching_[at(vertex)] = 1;
    }
  }
  double part = 1.0 / options_.load_steps;
  const double smallest = smallest_step * part;
  for (double done = 0.0; done < 1.0;) {
    const bool last = done + part > 1.0 - smallest;
    const double load = last ? 1.0 : done + part;
    const Vectors before = x_;
    const std::vector<char> touching_before = touching_;
    careful_ = part > smallest;
    result.converged = settle(load, last ? options_.tolerance : std::max(loose, options_.tolerance));
    if (result.converged || !careful_) {
      done = load;
      continue;
    }
    x_ = before;
    touching_ = touching_before;
    part *= 0.5;
  }
  result.positions = x_;
  Vectors gradient;
  evaluate(x_, 1.0, gradient);
  for (std::size_t v = 0; v < at(count_); ++v) {
    result.internal_forces.push_back(-gradient[v] - forces_[v]);
    if (touching_[v] == 0) continue;
    result.contacts.push_back(static_cast<int>(v));
    result.contact_force -= pushes_[v] * points_[v].direction;
  }
  result.iterations = iterations_;
  result.residual = left_over_ / reaction_;
  return result;
}

}  // namespace

Obstacle rigid_sphere(const Vector3& centre, double radius) {
  return [centre, radius](const Vector3& point) {
    const Vector3 out = point - centre;
    const double distance = out.norm();
    ObstaclePoint result;
    result.depth = radius - distance;
    if (!(distance > 0.0)) {
      result.direction = Vector3::UnitZ();  // every way is the shortest
      return result;
    }
    result.direction = out / distance;
    result.turn = (Matrix3::Identity() - result.direction * result.direction.transpose()) / distance;
    return result;
  };
}

Obstacle rigid_surface(const InstrumentSurface& surface, const Pose& pose) {
  return [&surface, pose](const Vector3& point) {
    const ClosestFeature feature = closest_feature(surface, pose.apply_inverse(point));
    ObstaclePoint result;
    result.depth = feature.depth;
    result.direction = pose.orientation * feature.direction;
    return result;
  };
}

ReferenceSolution solve_statics(const ReferenceProblem& problem, const ReferenceOptions& options) {
  const OneThread one_thread;
  return Solver(problem, options).solve();
}

}  // namespace tissue_sim
