#pragma once

#include <set>
#include <string>

namespace tissue_sim {

/// What is wrong with a bag, or nothing: "a record in byte 4117 reaches past the end of the file". rosbag believes
/// every length and every offset in a bag: it makes room for what is announced, and reads where the index points, be it
/// outside of its buffer. Here all of them are held against the bytes that are there; inside the chunks too, of those
/// that hold a message on one of `topics` (without a slash in front), which are the only ones that rosbag will open.
/// Format: wiki.ros.org/Bags/Format/2.0.
std::string fault_in_bag(const std::string& path, const std::set<std::string>& topics);

}  // namespace tissue_sim
