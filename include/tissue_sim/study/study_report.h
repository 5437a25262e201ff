#pragma once

#include <string>
#include <vector>

#include "tissue_sim/study/accuracy_study.h"

namespace tissue_sim {

/// study.json: one object, a row for each of `rows`; null where a number was not computed.
std::string study_json(const std::vector<StudyRow>& rows, const std::string& command, const std::string& machine);

/// A table for each case, in Markdown.
std::string study_tables(const std::vector<StudyRow>& rows, const std::string& command, const std::string& machine);

/// The table from which a scene's `accuracy` chooses (config/accuracy.yaml): presses only, both integrators with steps
/// of a millisecond, exact depths, restoration.
std::string accuracy_table(const std::vector<StudyRow>& rows, const std::string& command, const std::string& machine);

}  // namespace tissue_sim
