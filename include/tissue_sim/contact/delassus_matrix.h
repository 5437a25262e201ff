#pragma once

#include <vector>

#include "tissue_sim/contact/contact_point.h"

namespace tissue_sim {

/// How much velocity along its direction a contact point gets from a unit of impulse at another: W = J M^-1 J^T, 1/kg,
/// where row i of J makes of the velocities of the vertices that of point i along its direction (Delassus 1917). Points
/// that share no vertex leave each other alone, so most of it is zero. It holds for as long as the points stay the same
/// ones, keep directions and bearers, and the vertices their masses.
class DelassusMatrix {
 public:
  /// Makes room for as many points over as many vertices.
  void reserve(std::size_t points, std::size_t vertices);

  /// Of these points, over vertices of these inverse masses (1/kg). Allocates only while it grows.
  void build(const std::vector<ContactPoint>& points, const std::vector<double>& inverse_mass);

  std::size_t size() const { return effective_mass_.size(); }

  /// Non-negative impulses (N s; before the call a guess) that give each point what it is lacking along its direction
  /// (m/s): projected Gauss-Seidel over the points in order, until next to nothing changes or 16 rounds are over.
  /// A point that cannot move gets none. Forces (N) from accelerations (m/s^2) just as well.
  void solve(const std::vector<double>& lacking, std::vector<double>& impulses) const;

 private:
  struct Entry {
    int point;
    double share;  ///< of the matrix, times the effective mass of the row
  };
  /// That a point bears on a vertex: an entry in a list of the vertex.
  struct Bearing {
    int point;
    int next;
    double weight;
  };

  void list_bearings(const std::vector<ContactPoint>& points, std::size_t vertices);
  void add_row(const std::vector<ContactPoint>& points, const std::vector<double>& inverse_mass, int row);

  std::vector<double> effective_mass_;  ///< kg, of each point; 0 if it cannot move
  std::vector<double> kept_;            ///< of a point's impulse, from one round to the next, where mobility is bounded
  std::vector<int> first_;              ///< entry of each row, without the diagonal
  std::vector<Entry> entries_;

  // Room for build().
  std::vector<Bearing> bearings_;
  std::vector<int> first_of_vertex_;  ///< into bearings_; -1 between two calls
  std::vector<double> shared_;        ///< 1/kg, per point: by the vertices that it shares with the row's
  std::vector<int> sharing_with_;     ///< per point: the last row with which it shares any
  std::vector<int> sharing_;          ///< the points that share any with the row's
};

}  // namespace tissue_sim
