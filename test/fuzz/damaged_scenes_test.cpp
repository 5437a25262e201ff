#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "tissue_sim/scene/instrument_file.h"
#include "tissue_sim/scene/scene_file.h"
#include "tissue_sim/study/temporary_folder.h"

namespace tissue_sim::damaged_scenes_test {
namespace {

namespace fs = std::filesystem;

/// A shipped scene with its instruments as they are, and a block in the place of each organ: 220 x 120 x 70 mm, with a
/// vertex wherever the demonstration holds its liver.
class ShippedFiles {
 public:
  ShippedFiles() {
    for (const char* room : {"scenes", "instruments"}) {
      for (const auto& file : fs::directory_iterator(std::string(TISSUE_SIM_SOURCE_DIR) + "/config/" + room)) {
        folder_.write(std::string(room) + "/" + file.path().filename().string(), text_of(file.path()));
      }
    }
    for (const auto& file : fs::directory_iterator(TISSUE_SIM_SOURCE_DIR "/config/organs")) {
      const bool solid = file.path().extension() == ".msh";
      folder_.write("organs/" + file.path().filename().string(), solid ? block_msh() : block_obj());
    }
  }

  static std::string text_of(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  std::vector<fs::path> files(const std::string& room) const {
    std::vector<fs::path> found;
    for (const auto& file : fs::directory_iterator(folder_.path / room)) found.push_back(file.path());
    return found;
  }

  std::string write_beside(const fs::path& file, const std::string& text) const {
    return folder_.write((file.parent_path().filename() / ("damaged" + file.extension().string())).string(), text);
  }

 private:
  static std::vector<Vector3> points() {
    std::vector<Vector3> points = {{0, 0, -40}};
    for (int i = 0; i < 8; ++i) points.emplace_back(i & 1 ? 110 : -110, i & 2 ? 60 : -60, i & 4 ? 30 : -40);
    return points;
  }
  static std::vector<Triangle> triangles() {
    return {{0, 1, 3}, {0, 3, 4}, {0, 4, 2}, {0, 2, 1}, {5, 6, 8}, {5, 8, 7}, {1, 2, 6},
            {1, 6, 5}, {3, 7, 8}, {3, 8, 4}, {1, 5, 7}, {1, 7, 3}, {2, 4, 8}, {2, 8, 6}};
  }
  static std::string block_obj() {
    std::ostringstream text;
    for (const Vector3& p : points()) text << "v " << p.transpose() << "\n";
    for (const Triangle& t : triangles()) text << "f " << t[0] + 1 << " " << t[1] + 1 << " " << t[2] + 1 << "\n";
    return text.str();
  }
  /// A tetrahedron from each triangle to the middle.
  static std::string block_msh() {
    std::ostringstream text;
    text << "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n10\n";
    int n = 0;
    for (const Vector3& p : points()) text << ++n << " " << p.transpose() << "\n";
    text << "10 0 0 0\n$EndNodes\n$Elements\n" << triangles().size() << "\n";
    n = 0;
    for (const Triangle& t : triangles()) {
      text << ++n << " 4 0 " << t[0] + 1 << " " << t[1] + 1 << " " << t[2] + 1 << " 10\n";
    }
    text << "$EndElements\n";
    return text.str();
  }

  TemporaryFolder folder_;
};

struct Outcome {
  int loaded = 0;
  int refused = 0;
};

/// Loads, or is refused in one line that begins with the path.
template <typename Load>
void try_load(const std::string& path, Load load, Outcome& outcome) {
  try {
    load(path);
    ++outcome.loaded;
  } catch (const SceneError& error) {
    const std::string line = error.what();
    EXPECT_EQ(line.compare(0, path.size(), path), 0) << line;
    EXPECT_EQ(line.find('\n'), std::string::npos) << line;
    EXPECT_GT(line.size(), path.size() + 10) << line;
    ++outcome.refused;
  }
}

/// Every truncation, and every byte changed into one of `others`; with TISSUE_SIM_LONG=1 into every other byte.
template <typename Load>
Outcome damage(const ShippedFiles& shipped, const fs::path& file, Load load) {
  const std::string text = ShippedFiles::text_of(file);
  Outcome outcome;
  for (std::size_t length = 0; length < text.size(); ++length) {
    SCOPED_TRACE(file.filename().string() + " cut to " + std::to_string(length) + " bytes");
    try_load(shipped.write_beside(file, text.substr(0, length)), load, outcome);
  }
  const std::string others("\0\t\n \"':[{&*-!%#<>/?9.e\x7f\x80\xff", 25);
  const bool all = std::getenv("TISSUE_SIM_LONG") != nullptr;
  for (std::size_t at = 0; at < text.size(); ++at) {
    std::string damaged = text;
    for (int i = 0; i < (all ? 256 : 1); ++i) {
      damaged[at] = all ? static_cast<char>(i) : others[at % others.size()];
      SCOPED_TRACE(file.filename().string() + ", byte " + std::to_string(at) + " is " +
                   std::to_string(static_cast<unsigned char>(damaged[at])));
      try_load(shipped.write_beside(file, damaged), load, outcome);
    }
  }
  EXPECT_GT(outcome.refused, static_cast<int>(text.size()) / 2) << file;
  EXPECT_GT(outcome.loaded, 0) << file;
  return outcome;
}

TEST(ShippedScenes, LoadOrAreRefusedByNameWhateverIsCutOrChanged) {
  const ShippedFiles shipped;
  const auto load = [](const std::string& path) {
    std::vector<std::string> warnings;
    load_scene(path, warnings);
  };
  const std::vector<fs::path> scenes = shipped.files("scenes");
  ASSERT_GE(scenes.size(), 3U);
  for (const fs::path& scene : scenes) {
    ASSERT_NO_THROW(load(scene.string())) << scene;
    damage(shipped, scene, load);
  }
}

TEST(ShippedInstruments, LoadOrAreRefusedByNameWhateverIsCutOrChanged) {
  const ShippedFiles shipped;
  const auto load = [](const std::string& path) {
    std::vector<std::string> warnings;
    load_instrument(path, "tip", warnings);
  };
  for (const fs::path& instrument : shipped.files("instruments")) {
    ASSERT_NO_THROW(load(instrument.string())) << instrument;
    damage(shipped, instrument, load);
  }
}

}  // namespace
}  // namespace tissue_sim::damaged_scenes_test
