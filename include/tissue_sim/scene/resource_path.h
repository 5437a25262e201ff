#pragma once

#include <string>

namespace tissue_sim {

/// The file that `reference` names: `package://<package>/<path>`, `file:///<path>`, an absolute path, or a path
/// relative to the folder of `naming_file`, the file in which the reference stands. Throws SceneError.
///
/// Packages are found as rospack finds them, without ROS: below each folder of ROS_PACKAGE_PATH, by the <name> in
/// package.xml, not descending into packages or past CATKIN_IGNORE; then in share/<package> of each folder of
/// CMAKE_PREFIX_PATH; then among the folders that hold `naming_file`, so that a package's own files load with no
/// environment at all.
std::string resolve_path(const std::string& reference, const std::string& naming_file);

}  // namespace tissue_sim
