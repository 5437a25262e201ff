#pragma once

#include <vector>

#include "tissue_sim/tissue/constraint_batch.h"
#include "tissue_sim/tissue/neo_hookean_batch.h"

namespace tissue_sim {

/// A vertex with elements in several chunks. All but the first of them have a stand-in for it: a vertex of their own,
/// which is moved with it and whose forces are added to its in the order of the chunks.
struct Seam {
  int vertex = 0;
  int first_stand_in = 0;
  int stand_ins = 0;
};

struct ElementChunk {
  BatchRange tetrahedra;
  ConstraintRanges constraints;
};

/// The batches of a large organ in parts that add to no vertex in common, so that each can be computed by a thread of
/// its own. How they are cut depends on the organ only: the sums are the same bits for any number of threads.
struct ElementChunks {
  std::vector<ElementChunk> chunks;  ///< empty: the organ is too small
  std::vector<Seam> seams;           ///< by ascending vertex
  int stand_ins = 0;                 ///< behind all vertices

  bool empty() const { return chunks.empty(); }
};

/// Sorts the elements of each kind along a curve through the organ at rest (m), cuts it into `chunks` parts that take
/// about as long, and puts the stand-ins into them. From then on an element is not where it was packed.
ElementChunks cut_into_chunks(int chunks, const std::vector<Vector3>& rest, NeoHookeanSolid& solid,
                              ConstraintBatches& constraints);

}  // namespace tissue_sim
