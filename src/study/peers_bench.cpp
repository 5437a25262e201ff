#include <algorithm>
#include <cstdio>
#include <iterator>
#include <numeric>

#include "tissue_sim/simulation/step.h"
#include "tissue_sim/study/bench.h"
#include "tissue_sim/study/measuring.h"
#include "tissue_sim/study/peers.h"

namespace tissue_sim {

namespace {

constexpr std::size_t test_9 = 8;

/// m, tip frame. Our detection looks at the organ this far from where it is (src/contact/detection.cpp), because a
/// response puts vertices exactly on the instrument: FCL is shown the same, or rounding decides about them for it.
const Vector3 tie_break(0.61e-9, 0.37e-9, 0.70e-9);

/// Our step along the paper's path, one after the other.
class OurRun {
 public:
  OurRun(const PaperTest& test, Approach approach)
      : scene_(paper_scene(test, approach)),
        world_(build_world(scene_)),
        state_(rest_state(world_)),
        workspace_(build_workspace(world_)) {}

  /// The step to path[i]: the time of the whole call.
  PeerStep step_to(std::size_t i) {
    report.step = i;
    const Motion motion = {scene_.time_step, {{true, paper_pose(path[i - 1]), paper_pose(path[i])}}};
    const double start = processor_seconds();
    step(world_, motion, state_, workspace_, report);
    return {processor_seconds() - start, static_cast<int>(report.contacts.size())};
  }

  const Scene& scene() const { return scene_; }
  const std::vector<Vector3>& positions() const { return state_.organs.front().positions; }
  const Detection& detection() const { return workspace_.organs.front().detections.front(); }
  const RestShape& rest() const { return world_.organs.front().rest; }

  const std::vector<Vector3> path = paper_path();
  StepReport report;

 private:
  Scene scene_;
  World world_;
  State state_;
  Workspace workspace_;
};

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const std::size_t middle = values.size() / 2;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(middle), values.end());
  return values[middle];
}

/// Over the steps with contact.
struct Figures {
  std::vector<double> milliseconds;
  double contacts = 0.0;

  void add(const PeerStep& step) {
    if (step.contacts == 0) return;
    milliseconds.push_back(1e3 * step.seconds);
    contacts += step.contacts;
  }
  double contacts_a_step() const { return contacts / std::max<double>(1.0, static_cast<double>(milliseconds.size())); }
};

void print_row(const char* what, const std::string& peer, const char* settings, const Figures& ours,
               const Figures& theirs, JsonRows& json) {
  const double our_ms = median(ours.milliseconds);
  const double peer_ms = median(theirs.milliseconds);
  std::printf("%-9s  %-28s  %8.4f  %8.4f  %6.2f  %8.1f  %8.1f  %s\n", what, peer.c_str(), our_ms, peer_ms,
              peer_ms / our_ms, ours.contacts_a_step(), theirs.contacts_a_step(), settings);
  std::fflush(stdout);
  json.add(
      text("\"case\": \"%s\", \"peer\": \"%s\", \"ours_ms\": %.6g, \"peer_ms\": %.6g, \"ratio\": %.6g, "
           "\"our_contacts\": %.6g, \"peer_contacts\": %.6g, \"our_steps\": %zu, \"peer_steps\": %zu, "
           "\"peer_settings\": \"%s\"",
           what, peer.c_str(), our_ms, peer_ms, peer_ms / our_ms, ours.contacts_a_step(), theirs.contacts_a_step(),
           ours.milliseconds.size(), theirs.milliseconds.size(), settings));
}

/// Runs take turns, so that what else the machine does slows both.
void bench_bullet(int runs, JsonRows& json) {
  if (bullet_version().empty()) {
    std::printf("step       Bullet is absent: install libbullet-dev and build again\n");
    return;
  }
  for (const BulletSettings& settings : bullet_settings()) {
    Figures ours;
    Figures theirs;
    for (int run = 0; run < runs; ++run) {
      OurRun our_run(paper_tests[test_9], Approach::with_restoration);
      for (std::size_t i = 1; i < our_run.path.size(); ++i) ours.add(our_run.step_to(i));
      for (const PeerStep& step : run_bullet(paper_tests[test_9], settings)) theirs.add(step);
    }
    print_row("step", "Bullet, " + std::string(settings.name), settings.text, ours, theirs, json);
  }
}

/// What the crossings of both sides say of each other, over all steps.
struct Agreement {
  long long steps = 0;
  long long our_pairs = 0;      ///< of an organ triangle and an instrument triangle that an edge of it crosses
  long long peer_pairs = 0;     ///< of triangles that intersect
  long long ours_alone = 0;     ///< pairs that only we have
  long long our_triangles = 0;  ///< of the organ, that intersect the instrument
  long long peer_triangles = 0;
  long long triangles_differ = 0;  ///< that one side has and the other has not
};

std::vector<TrianglePair> our_pairs(const OurRun& run) {
  std::vector<TrianglePair> pairs;
  for (const Crossing& crossing : run.detection().crossings) {
    for (const int triangle : run.rest().topology.edge_triangles[crossing.edge]) {
      if (triangle >= 0) pairs.push_back({triangle, crossing.triangle});
    }
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

std::vector<int> organ_triangles(const std::vector<TrianglePair>& pairs) {
  std::vector<int> triangles;
  for (const TrianglePair& pair : pairs) {
    if (triangles.empty() || triangles.back() != pair[0]) triangles.push_back(pair[0]);
  }
  return triangles;
}

void compare(const std::vector<TrianglePair>& ours, const std::vector<TrianglePair>& theirs, Agreement& agreement) {
  std::vector<TrianglePair> alone;
  std::set_difference(ours.begin(), ours.end(), theirs.begin(), theirs.end(), std::back_inserter(alone));
  const std::vector<int> our_triangles = organ_triangles(ours);
  const std::vector<int> peer_triangles = organ_triangles(theirs);
  std::vector<int> differ;
  std::set_symmetric_difference(our_triangles.begin(), our_triangles.end(), peer_triangles.begin(),
                                peer_triangles.end(), std::back_inserter(differ));
  ++agreement.steps;
  agreement.our_pairs += static_cast<long long>(ours.size());
  agreement.peer_pairs += static_cast<long long>(theirs.size());
  agreement.ours_alone += static_cast<long long>(alone.size());
  agreement.our_triangles += static_cast<long long>(our_triangles.size());
  agreement.peer_triangles += static_cast<long long>(peer_triangles.size());
  agreement.triangles_differ += static_cast<long long>(differ.size());
}

/// Both look at the same positions in every step; the organ then goes on by our step.
void bench_fcl(FclTree tree, bool points, int runs, JsonRows& json, Agreement& agreement) {
  Figures ours;
  Figures theirs;
  for (int turn = 0; turn < runs; ++turn) {
    OurRun run(paper_tests[test_9], Approach::with_restoration);
    const std::unique_ptr<FclDetection> fcl =
        make_fcl_detection(tree, run.scene().organs.front().mesh, run.scene().instruments.front().parts.front().mesh);
    std::vector<TrianglePair> pairs;
    std::vector<Vector3> shifted;
    for (std::size_t i = 1; i < run.path.size(); ++i) {
      const Pose pose = paper_pose(run.path[i]);
      shifted = run.positions();
      for (Vector3& p : shifted) p += pose.orientation * tie_break;
      const PeerStep found = fcl->detect(shifted, pose, points, pairs);
      run.step_to(i);
      const std::vector<TrianglePair> own = our_pairs(run);
      if (own.empty() && pairs.empty()) continue;
      compare(own, pairs, agreement);
      ours.add({run.report.profile.refit + run.report.profile.detection, static_cast<int>(own.size())});
      theirs.add(found);
    }
  }
  print_row("detection", "FCL, BVHModel<" + std::string(to_string(tree)) + ">",
            points ? "all pairs, their points and normals" : "all pairs", ours, theirs, json);
}

void bench_fcl(int runs, JsonRows& json) {
  if (fcl_version().empty()) {
    std::printf("detection  FCL 0.6 or newer is absent: install libfcl-dev and build again\n");
    return;
  }
  Agreement agreement;
  Agreement others;
  for (const FclTree tree : fcl_trees) {
    for (const bool points : {false, true})
      bench_fcl(tree, points, runs, json, tree == FclTree::aabb ? agreement : others);
  }
  const double steps = static_cast<double>(std::max<long long>(1, agreement.steps));
  const auto a_step = [&](long long count) { return static_cast<double>(count) / steps; };
  std::printf(
      "\nFCL's pairs are triangles that intersect (contacts: pairs a step); ours are those of them where an edge of "
      "the "
      "organ's triangle crosses the\ninstrument's. A step: %.1f of FCL, %.1f of ours, %.4f of ours that FCL has not. "
      "Organ triangles that intersect the instrument, a step:\n%.1f by FCL, %.1f by ours, %.4f that one of the two "
      "has and the other has not.\n",
      a_step(agreement.peer_pairs), a_step(agreement.our_pairs), a_step(agreement.ours_alone),
      a_step(agreement.peer_triangles), a_step(agreement.our_triangles), a_step(agreement.triangles_differ));
  json.add(
      text("\"case\": \"crossings\", \"peer\": \"FCL\", \"steps\": %lld, \"our_pairs\": %.6g, \"peer_pairs\": %.6g, "
           "\"pairs_ours_alone\": %.6g, \"our_organ_triangles\": %.6g, \"peer_organ_triangles\": %.6g, "
           "\"organ_triangles_differ\": %.6g",
           agreement.steps, a_step(agreement.our_pairs), a_step(agreement.peer_pairs), a_step(agreement.ours_alone),
           a_step(agreement.our_triangles), a_step(agreement.peer_triangles), a_step(agreement.triangles_differ)));
}

}  // namespace

bool bench_peers(BenchWords& words, JsonRows& json) {
  int runs = 3;
  const std::string only = words.take_value("--peer");
  const bool known = only.empty() || only == "bullet" || only == "fcl";
  if (!known || !words.take_number("--runs", 1, 1000, runs) || !words.words.empty()) return false;
  std::printf(
      "Test 9 of Table 1 with restoration, spheres of 8064 triangles, one core: median ms over the steps with "
      "contact;\n"
      "of the whole step in time of the processor, of detection in wall time, step by step in turns\n"
      "Ours: model surface (edges, areas, flaps, enclosed volume), depths by Eq. 1-6, restoration, explicit, 1 "
      "substep\n"
      "Bullet %s: cm, float, gravity 0, kinematic sphere, attached vertices without mass, 1 step of 1 "
      "ms\n"
      "FCL %s: double, the organ's tree refitted in every step, the instrument's built once\n\n",
      bullet_version().empty() ? "-" : bullet_version().c_str(), fcl_version().empty() ? "-" : fcl_version().c_str());
  std::printf("case       peer                           ours_ms   peer_ms   ratio  contacts      peer  settings\n");
  if (only.empty() || only == "bullet") bench_bullet(runs, json);
  if (only.empty() || only == "fcl") bench_fcl(runs, json);
  return true;
}

}  // namespace tissue_sim
