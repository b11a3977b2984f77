// Names of what studies find: through a record's text and back, and what is asked of all rooms.
#include "experiments/studies/findings.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "host/error.hpp"
#include "tests/message_of.hpp"

namespace clerestory {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

MetricRecord record(const RoomFindings& found) { return {1, 0, found.values()}; }

TEST(Findings, NamesSurviveTheirText) {
  const Finding whole{"relmse", "render", "net+lamps .5,1", "true", "3"};
  EXPECT_EQ(text_of(whole), "relmse|render|net+lamps .5,1|true|3");
  EXPECT_EQ(finding_from(text_of(whole), ""), whole);
  const Finding bare{"dropped"};
  EXPECT_EQ(text_of(bare), "dropped||||");
  EXPECT_EQ(finding_from(text_of(bare), ""), bare);
}

TEST(Findings, OtherTextIsRefused) {
  EXPECT_THROW(text_of({"relmse", "a|b"}), Error);
  for (const char* text : {"relmse", "relmse|a|b|c", "relmse|a|b|c|d|e"})
    EXPECT_THAT(message_of<Error>([&] { finding_from(text, "metrics.jsonl"); }),
                testing::AllOf(HasSubstr("metrics.jsonl"), HasSubstr(text)));
}

TEST(Findings, OfARoomSeveralAreTheirMeanOrTheirSum) {
  RoomFindings room;
  for (const double v : {1.0, 2.0, 6.0}) room.add({"relmse"}, v), room.sum({"rays"}, v);
  Findings found;
  found.add_room(record(room), "");
  EXPECT_EQ(found.value(0, {"relmse"}), 3);
  EXPECT_EQ(found.value(0, {"rays"}), 9);
}

TEST(Findings, RoomsAndSeeds) {
  const Finding error{"relmse", "hits", "net"};
  RoomFindings first, second, third;
  first.add(error.of(0), 1), first.add(error.of(1), 3), first.add({"relmse", "misses", "net"}, 50);
  second.add(error.of(0), 5), second.add(error.of(1), NAN);
  third.add({"ball"}, 1);
  Findings found;
  for (const RoomFindings* room : {&first, &second, &third}) found.add_room(record(*room), "");

  ASSERT_EQ(found.rooms(), 3u);
  EXPECT_EQ(found.value(2, error.of(0)), std::nullopt);
  EXPECT_THAT(found.values(error.of(0)), ElementsAre(1, 5));
  EXPECT_THAT(found.seed_means(error, 3), ElementsAre(3, 3)) << "of seed 1 the NaN is left out; seed 2 no room has";
  EXPECT_THAT(found.room_means(error), ElementsAre(2, 5));
  EXPECT_THAT(found.finite_items(error), ElementsAre(1, 3, 5));
  EXPECT_EQ(found.items(0, error), (std::map<std::string, double>{{"0", 1}, {"1", 3}}));

  const Findings::BySeed all = found.by_seed(error, 2), present = found.present_by_seed(error, 3);
  ASSERT_EQ(all.size(), 3u);
  EXPECT_THAT(all[0], ElementsAre(1, 3));
  EXPECT_TRUE(std::isnan(all[1][1]) && std::isnan(all[2][0]) && std::isnan(all[2][1]));
  ASSERT_EQ(present.size(), 2u) << "the third room has none";
  EXPECT_THAT(present[0], ElementsAre(1, 3));
}

}  // namespace
}  // namespace clerestory
