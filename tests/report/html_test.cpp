#include "host/report/html.hpp"

#include <array>
#include <cmath>
#include <regex>

#include "host/error.hpp"
#include "host/io/exposure.hpp"
#include "host/io/image.hpp"
#include "host/report/sha256.hpp"
#include "tests/report/temporary_folder.hpp"
#include "tests/roundings.hpp"

namespace clerestory {
namespace {

Image filled(int width, int height, const std::array<float, 3>& colour) {
  Image image(width, height, 3);
  for (int c = 0; c < 3; ++c) std::fill_n(image.plane(c), image.pixels(), colour[static_cast<std::size_t>(c)]);
  return image;
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (std::size_t at = 0; (at = text.find(part, at)) != std::string::npos; at += part.size()) ++n;
  return n;
}

TEST(Base64, KnownValues) {
  // RFC 4648, section 10.
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64("\xff\xfe\xfd"), "//79");
}

TEST(Sha256, KnownValues) {
  // FIPS 180-4's examples: of one block, of two, and the empty text; one block more begins at 56 bytes.
  EXPECT_EQ(base64(sha256("abc")), "ungWv48Bz+pBQUDeXa4iI7ADYaOWF3qctBD/YfIAFa0=");
  EXPECT_EQ(base64(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq")),
            "JI1qYdIGOLjlwCaTDD5gOaM85Flk/yFn9uzt1BnbBsE=");
  EXPECT_EQ(base64(sha256("")), "47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU=");
  EXPECT_EQ(base64(sha256(std::string(1000, 'a'))), "Qe3s5C1j6Nm/UVqbppMuHCDLyfWl0TRkWttdsblzfqM=");
}

TEST(Previews, RadianceNormalDepthAmount) {
  const Image tone = show_radiance(filled(1, 1, {0.25f, -1, 9}), 2);
  EXPECT_FLOAT_EQ(tone.at(0, 0, 0), std::pow(0.5f, 1 / 2.2f));
  EXPECT_EQ(tone.at(1, 0, 0), 0);
  EXPECT_EQ(tone.at(2, 0, 0), 1);
  const Image normal = show_normal(filled(1, 1, {-1, 0, 1}));
  EXPECT_EQ(normal.at(0, 0, 0), 0);
  EXPECT_EQ(normal.at(1, 0, 0), 0.5f);
  EXPECT_EQ(normal.at(2, 0, 0), 1);

  Image depth(4, 1, 1);
  depth.data = {0, 1, 2, 4};
  const auto luminance = [](const Image& i, int x) { return i.at(0, 0, x) + i.at(1, 0, x) + i.at(2, 0, x); };
  const Image shown = show_depth(depth, {1, 4});
  EXPECT_EQ(shown.at(0, 0, 0), 0.5f) << "no measurement";
  EXPECT_GT(luminance(shown, 1), luminance(shown, 2));
  EXPECT_GT(luminance(shown, 2), luminance(shown, 3)) << "near is bright, far is dark";
  const auto range = depth_range(depth);
  EXPECT_DOUBLE_EQ(range.first, 1.04);   // 1 + 0.02 * 2 * (2 - 1)
  EXPECT_DOUBLE_EQ(range.second, 3.92);  // 2 + 0.96 * (4 - 2)
  Image none(2, 1, 1);
  EXPECT_EQ(show_depth(none).at(0, 0, 0), 0.5f);

  Image amount(3, 1, 1);
  amount.data = {0, 1, std::nanf("")};
  const Image colours = show_amount(amount, 1);
  EXPECT_LT(luminance(colours, 0), luminance(colours, 1));
  EXPECT_EQ(colours.at(0, 0, 2), 0.5f);
  // Of three channels the mean: 0.5 here, which lies on the fourth of seven colours.
  EXPECT_EQ(show_amount(filled(1, 1, {0, 0.5f, 1}), 1).at(1, 0, 0),
            show_amount(filled(1, 1, {0.5f, 0.5f, 0.5f}), 1).at(1, 0, 0));
  EXPECT_THROW(show_depth(filled(1, 1, {1, 1, 1})), Error);
}

TEST(Previews, APictureForAScreenIsShownAsItIs) {
  EXPECT_EQ(shown_exposure(filled(4, 4, {0.15f, 0.15f, 0.15f})), 1) << "a dim one too";
  EXPECT_EQ(shown_exposure(filled(4, 4, {1.5f, 1.5f, 1.5f})), 1);
  EXPECT_DOUBLE_EQ(shown_exposure(filled(4, 4, {90, 90, 90})), 0.01);
  EXPECT_NEAR(shown_exposure(filled(4, 4, {0.009f, 0.009f, 0.009f})), 100, 100 * 2 * kFloatRounding);
}

TEST(Previews, BarsHaveTheColoursAndValuesOfTheirPictures) {
  Image ramp(3, 1, 1);
  ramp.data = {1, 2.5f, 4};
  const auto colour_at = [](const Image& shown, int x) {
    return std::array<float, 3>{shown.at(0, 0, x), shown.at(1, 0, x), shown.at(2, 0, x)};
  };
  const ColourBar depth = depth_bar({1, 4});
  EXPECT_EQ(depth.marks, (std::vector<std::string>{"1 m", "2.5 m", "4 m"}));
  EXPECT_EQ(depth.colours.front(), colour_at(show_depth(ramp, {1, 4}), 0));
  EXPECT_EQ(depth.colours.at(3), colour_at(show_depth(ramp, {1, 4}), 1)) << "the middle of seven";
  EXPECT_EQ(depth.colours.back(), colour_at(show_depth(ramp, {1, 4}), 2));
  const ColourBar amount = amount_bar(4, "W");
  EXPECT_EQ(amount.marks, (std::vector<std::string>{"0 W", "2 W", "4 W"}));
  EXPECT_EQ(amount.colours.back(), colour_at(show_amount(ramp, 4), 2));
  EXPECT_EQ(show_amount(ramp).data, show_amount(ramp, amount_range(ramp)).data);
  EXPECT_EQ(unit_bar().marks, (std::vector<std::string>{"0", "0.5", "1"}));
}

TEST(HtmlReport, HoldsEverythingAndNeedsNothing) {
  Provenance provenance = begin_provenance({"clerestory", "invert", "a <b>.png"}, "PoCL <device>");
  provenance.left_out = {{"emission", "no lamp", "1 MB"}};
  Table table{"Errors", {{"sampler", ""}, {"relMSE", "", Best::Lowest}}, {}};
  table.add({std::string("a & b"), Measure{2, 0.5, 3}});
  table.add({std::string("c"), Measure{1, 0.25, 3}});
  Plot plot;
  plot.series = {{"curve", {1, 2}, {1, 2}, {}, Stroke::Line}};
  HtmlReport report("Room <1>", "subtitle");
  report.section("One", "text & more").facts({{"Field of view", "57°"}});
  report.section("Two").pictures({picture_of("Albedo", filled(8, 4, {0.5f, 0.5f, 0.5f}), "note")}, "caption");
  Picture strip = picture_of("Strip", filled(8, 4, {1, 1, 1}));
  strip.columns = {"left", "right & last"};
  report.pictures({strip});
  report.pictures({picture_of("Depth", filled(9, 4, {0, 0, 0}), "", depth_bar({1, 2}))}).notes({{"Scale", "of <x>"}});
  report.section("Three").compare("Before", filled(8, 4, {0.2f, 0.2f, 0.2f}), "After",
                                  filled(8, 4, {0.3f, 0.3f, 0.3f}));
  report.table(table).plot(plot).plot(plot).left_out(provenance.left_out).details("Config", "a < b").footer(provenance);
  const std::string html = report.html();

  for (const char* part :
       {"<!doctype html>", "<title>Room &lt;1&gt;</title>", "text &amp; more", "a &amp; b", "57°",
        "<summary>Config</summary>", "a &lt; b", "PoCL &lt;device&gt;", "clerestory invert 'a &lt;b&gt;.png'",
        "What was left out", "<strong>1.00<span class=\"deviation\"> ± 0.25</span></strong>", "<a href=\"#s2\">Two</a>",
        "<figure class=\"row\">", "<span>1 m</span><span>1.5 m</span><span>2 m</span>",
        "<dt>Scale</dt><dd>of &lt;x&gt;</dd>", "<span>left</span><span>right &amp; last</span>"})
    EXPECT_NE(html.find(part), std::string::npos) << part;
  EXPECT_EQ(html.find("Room <1>"), std::string::npos) << "text is escaped";
  EXPECT_EQ(count(html, "<figure class=\"row\">"), 1u) << "only what is more than twice as wide as high";

  // Nothing is loaded from anywhere: every source is a data URL, every link stays on the page.
  const std::regex source("(src|href|url)\\s*[=(]\\s*[\"']?([^\"')\\s>]+)");
  for (auto it = std::sregex_iterator(html.begin(), html.end(), source); it != std::sregex_iterator(); ++it) {
    const std::string target = (*it)[2];
    EXPECT_TRUE(target.starts_with("data:") || target.starts_with("#") || target.starts_with("image.src")) << target;
  }
  EXPECT_EQ(html.find("<link"), std::string::npos);
  // Ids of the two plots do not meet.
  EXPECT_EQ(count(html, "id=\"p1gnuplot_canvas\""), 1u);
  EXPECT_EQ(count(html, "id=\"p2gnuplot_canvas\""), 1u);
  for (const char* tag : {"figure", "div", "table", "details", "section", "main", "footer", "dl", "label"})
    EXPECT_EQ(count(html, std::string("<") + tag + ">") + count(html, std::string("<") + tag + " "),
              count(html, std::string("</") + tag + ">"))
        << tag;
}

/// What stands between a tag and its end.
std::string inside(const std::string& html, const std::string& tag) {
  const std::size_t from = html.find("<" + tag + ">") + tag.size() + 2;
  return html.substr(from, html.find("</" + tag + ">") - from);
}

// Whatever a name or a file brings into the page, a browser runs and loads nothing but what the page came with.
TEST(HtmlReport, ThePolicyAllowsItsOwnScriptAndStyleAndNoNetwork) {
  HtmlReport report("t");
  const std::string html = report.compare("a", filled(4, 4, {1, 1, 1}), "b", filled(4, 4, {1, 1, 1})).html();
  const std::string meta = "<meta http-equiv=\"Content-Security-Policy\" content=\"";
  ASSERT_NE(html.find(meta), std::string::npos);
  EXPECT_LT(html.find(meta), html.find("<style>")) << "it holds for what comes after it";
  const std::size_t from = html.find(meta) + meta.size();
  const std::string policy = html.substr(from, html.find('"', from) - from);
  EXPECT_EQ(policy, "default-src 'none'; img-src data:; style-src-elem 'sha256-" +
                        base64(sha256(inside(html, "style"))) +
                        "'; style-src-attr 'unsafe-inline'; script-src 'sha256-" +
                        base64(sha256(inside(html, "script"))) + "'; base-uri 'none'; form-action 'none'");
  EXPECT_EQ(count(html, "<script"), 1u);
  EXPECT_EQ(count(html, "<style"), 1u);
  EXPECT_EQ(html.find("http://"), std::string::npos);
  EXPECT_EQ(html.find("https://"), std::string::npos);
}

const std::string hostile = "\"><script>alert(1)</script><img src=x onerror=alert(2)>&'";

TEST(HtmlReport, HostileNamesAreText) {
  Table table{hostile, {{hostile, hostile}}, {}};
  table.add({hostile});
  Plot plot;
  plot.title = plot.x_label = plot.y_label = hostile;
  plot.series = {{hostile, {1, 2}, {1, 2}, {}, Stroke::Line}};
  Provenance provenance = begin_provenance({"clerestory", hostile}, hostile);
  HtmlReport report(hostile, hostile);
  report.section(hostile, hostile).paragraph(hostile).facts({{hostile, hostile}});
  report.pictures({picture_of(hostile, filled(2, 2, {1, 0, 0}), hostile)}, hostile);
  report.compare(hostile, filled(2, 2, {1, 1, 1}), hostile, filled(2, 2, {1, 1, 1}), hostile);
  report.table(table, hostile).plot(plot, hostile).details(hostile, hostile).left_out({{hostile, hostile, hostile}});
  const std::string html = report.footer(provenance).html();
  EXPECT_EQ(count(html, "<script"), 1u) << "the page's own";
  EXPECT_EQ(html.find("<img src=x"), std::string::npos);
  EXPECT_EQ(html.find("\\\"><"), std::string::npos);
}

// In an img element an SVG runs no script and loads nothing.
TEST(HtmlReport, DrawingsOfFilesAreImages) {
  const std::string svg =
      "<svg xmlns='http://www.w3.org/2000/svg' onload='alert(1)'><script>alert(7)</script>"
      "<foreignObject><iframe src='https://example.org'/></foreignObject></svg>";
  HtmlReport report("t");
  const std::string html = report.drawing(svg, hostile).html();
  EXPECT_NE(html.find("src=\"data:image/svg+xml;base64," + base64(svg) + "\""), std::string::npos);
  for (const char* part : {"<svg", "onload", "alert(7)", "iframe"})
    EXPECT_EQ(html.find(part), std::string::npos) << part;
  EXPECT_EQ(count(html, "<script"), 1u);
  EXPECT_THROW(report.drawing("no drawing"), Error);
}

TEST(HtmlReport, CompareStoresTheExposuresThatAreNeeded) {
  HtmlReport dim("t"), bright("t");
  dim.compare("a", filled(4, 4, {0.5f, 0.5f, 0.5f}), "b", filled(4, 4, {0.5f, 0.5f, 0.5f}));
  EXPECT_EQ(count(dim.html(), "<img data-ev="), 2u) << "nothing is clipped: one picture a side";
  Image lamp = filled(4, 4, {0.5f, 0.5f, 0.5f});
  lamp.at(0, 0, 0) = 20;  // needs -6: 20 / 64 < 1 < 20 / 8
  bright.compare("a", filled(4, 4, {0.5f, 0.5f, 0.5f}), "b", lamp);
  EXPECT_EQ(count(bright.html(), "<img data-ev="), 1u + 3u);
  EXPECT_NE(bright.html().find("data-ev=\"-6\""), std::string::npos);
  EXPECT_EQ(bright.html().find("data-ev=\"-9\""), std::string::npos);
}

TEST(HtmlReport, TheBarOfAComparisonStandsWhereItIsPut) {
  HtmlReport report("t");
  report.compare("a", filled(4, 4, {1, 1, 1}), "b", filled(4, 4, {1, 1, 1}), "", 10);
  EXPECT_NE(report.html().find("--at:10%"), std::string::npos);
  EXPECT_NE(report.html().find("value=\"10\" aria-label"), std::string::npos);
}

TEST(HtmlReport, CompareRefusesUnequalPictures) {
  HtmlReport report("t");
  EXPECT_THROW(report.compare("a", filled(4, 4, {}), "b", filled(4, 5, {})), Error);
  EXPECT_THROW(report.compare("a", Image(4, 4, 1), "b", filled(4, 4, {})), Error);
}

class HtmlFiles : public InTemporaryFolder {};

TEST_F(HtmlFiles, EmbedsPngFilesAndRefusesOthers) {
  write_png(folder_ / "a.png", filled(5, 3, {1, 0, 0}));
  const Picture picture = picture_file("A", folder_ / "a.png");
  EXPECT_EQ(picture.png, text_of(folder_ / "a.png"));
  HtmlReport report("t");
  report.pictures({picture});
  EXPECT_NE(report.html().find("width=\"5\" height=\"3\""), std::string::npos);
  report.write(folder_ / "report.html");
  EXPECT_EQ(text_of(folder_ / "report.html"), report.html());
  put(folder_ / "b.png", "not a picture");
  EXPECT_THROW(picture_file("B", folder_ / "b.png"), Error);
  EXPECT_THROW(picture_file("C", folder_ / "c.png"), Error);
}

}  // namespace
}  // namespace clerestory
