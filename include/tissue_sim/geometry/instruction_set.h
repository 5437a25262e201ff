#pragma once

namespace tissue_sim {

/// Which registers are computed in: 16 bytes wide, which every x86-64 has (and other processors by the compiler's own
/// means), or 32; with AVX-512 64 where packed triangles are compared (geometry/wide_tree.h) and for cubes of a lattice
/// (tissue/lattice_cubes.h), and 32 and twice as many of them for distances, areas and volumes
/// (tissue/constraint_batch.h). All give the same bits: the lanes do not meet, and forces are added in the order of the
/// elements. Tetrahedra are not compiled for it: on a Zen 4 core they take 9.4 and 6.5 ns, and 64 bytes took 5.8
/// (8.7, 6.1 and 5.4 on Zen 5), too little for a third.
enum class InstructionSet { baseline, avx2, avx512 };

/// Whether this build has code for it and this processor can run it. `baseline` always is.
bool available(InstructionSet set);

/// The one that was set, else the fastest that is available.
InstructionSet instruction_set();

/// For the whole program, before it has built or computed anything. Throws std::invalid_argument where the set is not
/// available.
void use_instruction_set(InstructionSet set);

const char* name(InstructionSet set);

}  // namespace tissue_sim
