#include "tissue_sim/contact/ascending_set.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

namespace tissue_sim::ascending_set_test {
namespace {

TEST(AscendingSet, GivesWhatWasAddedOnceAndInOrder) {
  std::mt19937 random(1);
  for (const int n : {1, 63, 64, 65, 4096, 4097, 300000, 2000000}) {
    AscendingSet set;
    set.prepare(static_cast<std::size_t>(n));
    for (int round = 0; round < 5; ++round) {
      std::set<int> expected = {0, n - 1};
      for (int i = 0; i < 200 * round; ++i) expected.insert(static_cast<int>(random() % static_cast<unsigned>(n)));
      std::vector<int> shuffled(expected.begin(), expected.end());
      shuffled.insert(shuffled.end(), expected.begin(), expected.end());
      std::shuffle(shuffled.begin(), shuffled.end(), random);
      for (const int number : shuffled) set.add(number);
      std::vector<int> list;
      set.drain_to(list);
      EXPECT_EQ(list, std::vector<int>(expected.begin(), expected.end()));
      set.drain_to(list);
      EXPECT_EQ(list.size(), expected.size()) << "nothing is left";
    }
  }
}

}  // namespace
}  // namespace tissue_sim::ascending_set_test
