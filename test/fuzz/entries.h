#pragma once

#include <string>

namespace tissue_sim {

/// The doors through which bytes of strangers come in, one function a door. Each takes the bytes as they are and
/// returns the error that named them unfit, one line, or nothing where they were taken and what came of them is sound.
/// Whatever else happens (another exception, a message of two lines, an index out of range, a number that is none) is a
/// fault of ours and ends in std::logic_error or worse.
///
/// libFuzzer calls them (fuzzer.cpp), and so do the tests, with every file of test/fuzz/corpus/<door>.
using Door = std::string (*)(const std::string& bytes);

std::string enter_scene(const std::string& bytes);  ///< a scene file; one that loads is stepped twice
std::string enter_urdf(const std::string& bytes);
std::string enter_obj(const std::string& bytes);
std::string enter_stl(const std::string& bytes);
std::string enter_ply(const std::string& bytes);
std::string enter_dae(const std::string& bytes);
std::string enter_msh(const std::string& bytes);

// These link ROS (ros_entries.cpp).
std::string enter_bag(const std::string& bytes);
/// Messages as they stand on the wire, one after the other: a letter ('p' PoseStamped, 't' TFMessage), its length in
/// two bytes, the smaller first, and its bytes.
std::string enter_messages(const std::string& bytes);

/// Throws std::logic_error with `what`.
void require(bool holds, const std::string& what);

}  // namespace tissue_sim
