"""Clerestory's surfaces and window panes as plug-ins of Mitsuba 3, for scenes of `clerestory generate --mitsuba`.

Set a JIT variant (llvm_ad_rgb) before the import; importing registers the BSDF `clerestory` and the emitter
`clerestory_pane`. Written from the formulas, not from the kernels: Lambert albedo (1 - metallic) / pi plus GGX (Walter
et al. 2007) with height-correlated Smith masking (Heitz 2014), Schlick's Fresnel with F0 = lerp(0.04, albedo, metallic),
the surface of Zhu et al. 2022; directions by visible normals (Dupuy and Benyoub 2023) and by the cosine. Textures are
the procedural families of the rooms at a mesh's attribute `uvw`, metres; `look_from` says over which footprint they are
averaged where a ray from an eye first lands.
"""
import drjit as dr
import mitsuba as mi
import numpy as np

LEAST_ALPHA = 1e-4
MOST_SPECULAR_SHARE = 0.9
MOST_DIELECTRIC, MOST_METAL = 0.78, 0.92

_eye = None
_uvw = None


def look_from(origin, spread, axis=None):
    """Rays from `origin` see textures averaged over `spread` radians; with an axis, over a pixel that spans `spread` on
    the plane at distance 1 along it. None instead of an origin: everything is seen at points."""
    global _eye
    _eye = None
    if origin is None:
        return
    _eye = (mi.Point3f(*map(float, origin)), mi.Float(float(spread)),
            None if axis is None else mi.Vector3f(*map(float, axis)))
    dr.make_opaque(_eye)


class _Coordinates:
    """Texture coordinates of every triangle of a scene in one table. Mitsuba's attributes of a mesh say the same, but
    each is a call through the shape, and surfaces that make such calls are never compiled as one."""

    def __init__(self, shapes):
        number = lambda shape: int(dr.reinterpret_array(mi.UInt32, mi.ShapePtr(shape))[0])
        first, rows = {}, []
        for shape in shapes:
            first[number(shape)] = sum(map(len, rows))
            values = mi.traverse(shape)
            uvw = np.array(values["vertex_uvw"]).reshape(-1, 3)
            rows.append(uvw[np.array(values["faces"]).reshape(-1, 3)].reshape(-1, 9))
        offsets = np.zeros(max(first) + 1, dtype=np.uint32)
        for shape, at in first.items():
            offsets[shape] = at
        self.first, self.rows = mi.UInt32(offsets), mi.Float(np.concatenate(rows).astype(np.float32).ravel())
        dr.eval(self.first, self.rows)

    def __call__(self, si, active):
        triangle = dr.gather(mi.UInt32, self.first, dr.reinterpret_array(mi.UInt32, si.shape), active) + si.prim_index
        a, b, c = (dr.gather(mi.Vector3f, self.rows, 3 * triangle + k, active) for k in range(3))
        return a + (b - a) * si.uv.x + (c - a) * si.uv.y  # a mesh without texture coordinates has its triangles' own


# ---- Lattice noise --------------------------------------------------------------------------------------------------


def _mix(x):
    x = (x ^ (x >> 16)) * 0x85EBCA6B
    x = (x ^ (x >> 13)) * 0xC2B2AE35
    return x ^ (x >> 16)


def _mix_number(x):
    mask = 0xFFFFFFFF
    x = ((x ^ (x >> 16)) * 0x85EBCA6B) & mask
    x = ((x ^ (x >> 13)) * 0xC2B2AE35) & mask
    return x ^ (x >> 16)


def _whole(x):
    return mi.UInt32(mi.Int32(dr.floor(x)))


def _cell(x, y, z, key):
    """A number in [0, 1) for the lattice cell of whole x, y, z."""
    to = lambda n: n if isinstance(n, mi.UInt32) else mi.UInt32(n)
    h = (to(x) * 0x8DA6B343) ^ (to(y) * 0xD8163841) ^ (to(z) * 0xCB1AB31F)
    return mi.Float(_mix(h ^ key) >> 8) * 2.0**-24


def _noise(p, key):
    """Value noise of the eight corners around p."""
    base = [_whole(c) for c in p]
    t = [c - dr.floor(c) for c in p]
    t = [c * c * (3 - 2 * c) for c in t]
    along_z = []
    for k in (0, 1):
        along_y = []
        for j in (0, 1):
            a, b = (_cell(base[0] + i, base[1] + j, base[2] + k, key) for i in (0, 1))
            along_y.append(a + (b - a) * t[0])
        along_z.append(along_y[0] + (along_y[1] - along_y[0]) * t[1])
    return along_z[0] + (along_z[1] - along_z[0]) * t[2]


def _fractal(p, key):
    return (4 * _noise(p, key) + 2 * _noise(p * 2.03, key + 1) + _noise(p * 4.01, key + 2)) / 7


# ---- Patterns -------------------------------------------------------------------------------------------------------


def _ramp(low, high, x):
    t = dr.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def _wave(turns):
    return 0.5 + 0.5 * dr.sin(2 * dr.pi * (turns - dr.floor(turns)))


def _blur(value, mean, share):
    return mean + share * (value - mean)


def _line_share(x, half, width):
    """Share of the stretch of that width about x that lies within `half` of a whole number."""
    f = x - dr.floor(x)
    sharp = dr.select(dr.minimum(f, 1 - f) < half, mi.Float(1), mi.Float(0))
    a, b = x + half - 0.5 * width, x + half + 0.5 * width
    ends = dr.minimum(b - dr.floor(b), 2 * half) - dr.minimum(a - dr.floor(a), 2 * half)
    soft = dr.clip((2 * half * (dr.floor(b) - dr.floor(a)) + ends) / width, 0, 1)
    return dr.select(width > 1e-3, soft, sharp)


def _either(a, b):
    return a + b - a * b


def _where(condition):
    return dr.select(condition, mi.Float(1), mi.Float(0))


class _Texture:
    """Where a point of a surface lies in its pattern: weights b and c, and a factor of brightness. What is a matter of
    the material alone (its family, whether it has joints) is decided while the kernel is traced."""

    def __init__(self, props):
        number = lambda name: float(props[name])
        self.family = props["texture"]
        self.pattern = int(number("pattern"))
        self.key = mi.UInt32(_mix_number(int(number("seed"))))
        self.has = {k: number(k) > 0 for k in ("gap", "wear", "noise")}
        scale = props["scale"]
        self.has["rows"], self.has["columns"] = float(scale[1]) > 0, float(scale[0]) > 0
        self.scale = mi.Vector3f(*[float(scale[i]) for i in range(3)])
        self.gap, self.tint, self.warp = (mi.Float(number(k)) for k in ("gap", "tint", "warp"))
        self.noise, self.wear = mi.Float(number("noise")), mi.Float(number("wear"))
        self.clouded = {k: number(k) != 0 for k in ("smudge", "stain")}
        self.smudge, self.smudge_scale = mi.Float(number("smudge")), mi.Float(number("smudge_scale"))
        self.stain, self.stain_scale = mi.Float(number("stain")), mi.Float(number("stain_scale"))
        dr.make_opaque(self.key, self.scale, self.gap, self.tint, self.warp, self.noise, self.wear)
        dr.make_opaque(self.smudge, self.smudge_scale, self.stain, self.stain_scale)

    def __call__(self, p, footprint):
        family = {"plain": "plaster"}.get(self.family, self.family)
        b, c, tint = getattr(self, family)(p, footprint)
        if self.has["noise"]:
            fine = self.seen(45, footprint) * self.noise
            tint = tint + fine * (2 * _noise(p * 90, self.key + 6) - 1)
        if self.clouded["stain"]:
            tint = tint + self.stain * self.clouds(p, self.stain_scale, self.key + 31, footprint)
        return b, c, tint

    def smudged(self, roughness, p, footprint):
        """What varies beside the pattern's weights."""
        if self.clouded["smudge"]:
            roughness = roughness + self.smudge * self.clouds(p, self.smudge_scale, self.key + 37, footprint)
        return dr.clip(roughness, 0, 1)

    def clouds(self, p, scale, key, footprint):
        return self.seen(2 * scale, footprint) * (2 * _ramp(0.3, 0.7, _fractal(p * scale, key)) - 1)

    @staticmethod
    def seen(waves, footprint):
        return 1 - _ramp(0.25, 1, waves * footprint)

    def lighter(self, own):
        return 1 + self.tint * (2 * own - 1)

    def worn(self, p):
        return _ramp(1 - self.wear, 1, p) if self.has["wear"] else mi.Float(0)

    def plaster(self, p, footprint):
        return _fractal(p * self.scale, self.key), self.worn(_fractal(p * self.scale * 0.37, self.key + 9)), mi.Float(1)

    def wood(self, p, footprint):
        across = p.y * self.scale.y
        board = dr.floor(across) if self.has["rows"] else mi.Float(0)
        shift = _cell(_whole(board), 3, 7, self.key)
        along = p.x * self.scale.x + 5 * shift
        piece = dr.floor(along) if self.has["columns"] else mi.Float(0)
        own = _cell(_whole(board), _whole(piece), 11, self.key)
        q = mi.Vector3f(0.7 * p.x + 17 * own, p.y + 5 * own, p.z + shift)
        bend = _noise(q * mi.Vector3f(1.3, 7, 7), self.key + 1)
        rings = _blur(_wave((q.y + q.z) * self.scale.z + bend * self.warp), 0.5, self.seen(self.scale.z, footprint))
        streaks = _blur(_noise(q * mi.Vector3f(4, 160, 160), self.key + 2), 0.5, self.seen(80, footprint))
        b = dr.clip(0.65 * rings + 0.55 * streaks - 0.1, 0, 1)
        c = mi.Float(0)
        if self.has["gap"]:
            c = _line_share(across, self.gap, footprint * self.scale.y)
            if self.has["columns"]:
                ends = _line_share(along, self.gap * self.scale.x / self.scale.y, footprint * self.scale.x)
                c = _either(c, ends)
        return b, c, self.lighter(own)

    def tiles(self, p, footprint):
        x, y = p.x * self.scale.x, p.y * self.scale.y
        row = _whole(y)
        if self.pattern == 1:
            x = x + 0.5 * mi.Float(row & 1)
        column = _whole(x)
        own = _cell(column, row, 1, self.key)
        if self.pattern == 2:
            b = mi.Float((row + column) & 1)
        else:
            b = _fractal(mi.Vector3f(x, y, 31 * own) * self.warp, self.key + 1)
        c = _either(_line_share(x, self.gap, footprint * self.scale.x),
                    _line_share(y, self.gap * self.scale.y / self.scale.x, footprint * self.scale.y))
        return b, c, self.lighter(own)

    def fabric(self, p, footprint):
        u, v = (p.x + 0.31 * p.z) * self.scale.x, (p.y + 0.27 * p.z) * self.scale.y
        thread = _blur(_wave(16 * u) * _wave(16 * v), 0.25, self.seen(16 * self.scale.x, footprint))
        if self.pattern == 1:
            b = _ramp(0.45, 0.55, _wave(u))
        elif self.pattern == 2:
            b = 0.5 * (_ramp(0.6, 0.7, _wave(u)) + _ramp(0.6, 0.7, _wave(v)))
        else:
            b = _fractal(p * (self.scale * 3), self.key)
        return dr.clip(b + 0.35 * (thread - 0.25), 0, 1), mi.Float(0), self.lighter(thread)

    def stone(self, p, footprint):
        q = p * self.scale
        if self.pattern == 1:
            b = _ramp(0.5, 0.62, _noise(q * 9, self.key))
            c = _ramp(0.68, 0.74, _noise(q * 13, self.key + 5))
        else:
            b = _fractal(q, self.key)
            vein = _fractal(q * 1.7 + b * self.warp, self.key + 3)
            c = _ramp(0.86, 0.99, 1 - dr.abs(2 * vein - 1))
        tint = mi.Float(1)
        if self.has["gap"]:
            x, y, width = p.x / self.gap, p.y / self.gap, footprint / self.gap
            tint = self.lighter(_cell(_whole(x), _whole(y), 3, self.key))
            joint = 0.002 / self.gap
            c = c + (1 - c) * _either(_line_share(x, joint, width), _line_share(y, joint, width))
        return b, c, tint

    def metal(self, p, footprint):
        b = _blur(_noise(p * self.scale, self.key), 0.5, self.seen(0.5 * self.scale.y, footprint))
        c = mi.Float(0)
        if self.has["wear"]:
            c = _ramp(1 - self.wear, 1.1 - 0.5 * self.wear, _fractal(p * 5, self.key + 4) + 0.2 * b)
        return b, c, mi.Float(1)

    def leather(self, p, footprint):
        fold = dr.abs(2 * _noise(p * self.scale, self.key) - 1)
        b = _blur(_ramp(0, 0.35, fold), 0.8, self.seen(0.5 * self.scale.x, footprint))
        return b, self.worn(_fractal(p * 3, self.key + 4)), mi.Float(1)

    def rug(self, p, footprint):
        x, y = p.x * self.scale.x, p.y * self.scale.y
        motif = _wave(x) * _wave(y) + 0.5 * _wave(x + y) * _wave(x - y)
        if self.pattern == 1:
            b = _ramp(0.48, 0.52, _wave(x))
        elif self.pattern == 2:
            b = _ramp(0.4, 0.5, _wave(1.5 * self.scale.x * dr.sqrt(p.x * p.x + p.y * p.y)))
        else:
            b = _ramp(0.35, 0.45, motif)
        edge = dr.maximum(dr.abs(p.x), dr.abs(p.y))
        marked = (edge > 0.8) & (edge < 0.9)
        if self.pattern == 0:
            marked |= motif > 0.95
        return b, _where(marked), self.lighter(_noise(p * 120, self.key))

    def painting(self, p, footprint):
        q = mi.Vector3f(p.x, p.y, 0) * self.scale
        bend = _fractal(q, self.key)
        if self.pattern == 1:
            b = _ramp(-0.05, 0.05, p.y + 0.25 + 0.5 * (bend - 0.5))
            c = b * _ramp(0.5, 0.7, _fractal(q * mi.Vector3f(1, 3, 1), self.key + 7))
        elif self.pattern == 2:
            x, y = _whole(q.x + 0.3 * bend), _whole(q.y)
            b = _ramp(0.35, 0.4, _cell(x, y, 1, self.key))
            c = _ramp(0.7, 0.71, _cell(x, y, 2, self.key))
        else:
            b = _ramp(0.4, 0.6, _fractal(q + bend * self.warp, self.key + 5))
            c = _ramp(0.52, 0.62, _fractal(q * 1.3 - bend * self.warp, self.key + 8))
        return b, c, self.lighter(_noise(q * 40, self.key + 2))


    def print(self, p, footprint):
        x, y = (p.x + 0.61 * p.z) * self.scale.x, (p.y + 0.47 * p.z) * self.scale.y
        width = footprint * dr.maximum(self.scale.x, self.scale.y)
        pattern = _Print(self, p, x, y, width)
        b, c, mean_b, mean_c = getattr(pattern, _Print.NAMES[min(self.pattern, len(_Print.NAMES) - 1)])()
        share = 1 - _ramp(0.5, 1.5, width)
        thread = self.seen(60, footprint) * (2 * _noise(p * 120, self.key + 2) - 1)
        return _blur(b, mean_b, share), _blur(c, mean_c, share), 1 + self.tint * thread


class _Print:
    """Patterns in repeats of x and y, seen over `width` repeats: two weights, and their means from afar."""

    NAMES = ("stripes", "tartan", "dots", "damask", "flowers", "zigzag", "rings", "patches", "text", "blocks", "mosaic",
             "basket", "spread")

    def __init__(self, texture, p, x, y, width):
        self.texture, self.p, self.x, self.y, self.width = texture, p, x, y, width
        self.key = texture.key

    def at(self, x, y, z):
        return _cell(_whole(x), _whole(y), z, self.key)

    def inside(self, distance):
        return dr.clip(0.5 + distance / dr.maximum(self.width, 0.02), 0, 1)

    @staticmethod
    def off(x):
        return x - dr.floor(x) - 0.5

    def middle(self):
        return dr.abs(self.off(self.x)), dr.abs(self.off(self.y))

    def stripes(self):
        half, zero = 0.1 + 0.35 * self.at(self.x, mi.Float(0), 1), mi.Float(0)
        line = self.inside(0.05 - dr.abs(self.off(self.x + 0.3)))
        c = dr.select(self.at(self.x, zero, 2) > 0.5, line, 0)
        return self.inside(half - self.middle()[0]), c, 0.55, 0.05

    def tartan(self):
        mx, my = self.middle()
        u, v = (self.inside(0.04 - dr.abs(self.off(t + 0.35))) for t in (self.x, self.y))
        return 0.5 * (self.inside(0.3 - mx) + self.inside(0.3 - my)), _either(u, v), 0.6, 0.154

    def from_center(self, reach):
        """Off a point of the cell that lies within `reach` / 2 of its middle."""
        return (self.off(t) - reach * (self.at(self.x, self.y, k) - 0.5) for k, t in ((1, self.x), (2, self.y)))

    def dots(self):
        du, dv = self.from_center(0.4)
        radius, far = 0.12 + 0.15 * self.at(self.x, self.y, 3), dr.sqrt(du * du + dv * dv)
        hole = dr.select(self.at(self.x, self.y, 4) > 0.6, self.inside(0.5 * radius - far), 0)
        return self.inside(radius - far), hole, 0.125, 0.0125

    def damask(self):
        lift = 0.5 * mi.Float(_whole(self.x) & 1)
        motif = _fractal(mi.Vector3f(5 * self.middle()[0], 5 * dr.abs(self.off(self.y + lift)), 0), self.key)
        return self.inside(0.25 * (motif - 0.5)), self.inside(0.25 * (motif - 0.64)), 0.5, 0.15

    def flowers(self):
        du, dv = self.from_center(0.3)
        size, far = 0.2 + 0.12 * self.at(self.x, self.y, 3), dr.sqrt(du * du + dv * dv)
        petals = 4 + dr.floor(4 * self.at(self.x, self.y, 4))
        turn = 2 * dr.pi * self.at(self.x, self.y, 5)
        edge = size * (0.7 + 0.3 * dr.cos(petals * dr.atan2(dv, du) + turn))
        return self.inside(edge - far), self.inside(0.3 * size - far), 0.116, 0.0195

    def zigzag(self):
        along = self.y + 2 * self.middle()[0]
        return (self.inside(0.25 - dr.abs(self.off(along))), self.inside(0.04 - dr.abs(self.off(along + 0.4))), 0.5,
                0.08)

    def rings(self):
        du, dv = self.off(self.x + 0.5 * mi.Float(_whole(self.y) & 1)), self.off(self.y)
        wave = dr.abs(self.off(4 * dr.sqrt(du * du + dv * dv)))
        return self.inside(0.25 * (0.25 - wave)), mi.Float(0), 0.5, 0

    def patches(self):
        return self.at(self.x, self.y, 1), _where(self.at(self.x, self.y, 2) > 0.7), 0.5, 0.3

    def text(self):
        kind = self.at(self.x / 12, self.y / 8, 3)
        size = dr.select(kind < 0.3, mi.Float(1 / 3), 1)
        x, y = self.x * size, self.y * size
        marked = (self.at(1.6 * x, y, 1) > 0.2) & (dr.abs(self.off(y)) < 0.3) & (self.at(6.4 * x, 5 * y, 7) > 0.45)
        ink = _blur(_where(marked), 0.26, 1 - _ramp(0.08, 0.4, self.width * size))
        return dr.select((kind < 0.15) | (kind > 0.8), 0, ink), _where(kind > 0.8), 0.17, 0.2

    def blocks(self):
        mx, my = self.middle()
        half_u, half_v = (0.08 + 0.2 * self.at(self.x, self.y, k) for k in (1, 2))
        s, t = 0.7 * self.x + 0.37, 0.7 * self.y + 0.59
        du, dv = self.off(s), self.off(t)
        disc = 1.4 * (0.1 + 0.25 * self.at(s, t, 4) - dr.sqrt(du * du + dv * dv))
        return self.inside(dr.minimum(half_u - mx, half_v - my)), self.inside(disc), 0.13, 0.175

    def mosaic(self):
        first, second, value = mi.Float(9), mi.Float(9), mi.Float(0)
        for j in (-1, 0, 1):
            for i in (-1, 0, 1):
                column, row = dr.floor(self.x) + i, dr.floor(self.y) + j
                du = column + 0.15 + 0.7 * self.at(column, row, 1) - self.x
                dv = row + 0.15 + 0.7 * self.at(column, row, 2) - self.y
                far = dr.sqrt(du * du + dv * dv)
                value = dr.select(far < first, self.at(column, row, 3), value)
                second = dr.minimum(second, dr.maximum(first, far))
                first = dr.minimum(first, far)
        gap = self.texture.gap
        return value, self.inside(gap - 0.5 * (second - first)), 0.5, dr.minimum(4.2 * gap, 1)

    def basket(self):
        odd = ((_whole(self.x) + _whole(self.y)) & 1) == 1
        strands = _wave(4 * dr.select(odd, self.y, self.x))
        b = _blur(strands, 0.5, 1 - _ramp(0.06, 0.25, self.width))
        return b, _either(*(_line_share(t, 0.04, self.width) for t in (self.x, self.y))), 0.5, 0.154

    def spread(self):
        """Clouds in space."""
        q = self.p * self.texture.scale
        bend, soft = self.texture.warp * _fractal(q, self.key), dr.maximum(self.texture.gap, 0.02)
        b = _ramp(0.5 - soft, 0.5 + soft, _fractal(q + bend, self.key + 5))
        return b, _ramp(0.58, 0.58 + soft, _fractal(q * 1.3 - bend, self.key + 8)), 0.5, 0.2


# ---- The surface ----------------------------------------------------------------------------------------------------


def _luminance(c):
    return 0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z


def _schlick(f0, cosine):
    return f0 + (1 - f0) * dr.clip(1 - cosine, 0, 1)**5


class _Lobes:
    """The surface at a point as it is seen from a local direction v, v.z > 0."""

    def __init__(self, albedo, roughness, metallic, v):
        self.v = v
        self.alpha = dr.maximum(roughness * roughness, LEAST_ALPHA)
        self.diffuse = albedo * (1 - metallic)
        self.f0 = 0.04 + (albedo - 0.04) * metallic
        specular = dr.maximum(_luminance(_schlick(self.f0, v.z)), 0.01)
        rest = dr.maximum(_luminance(self.diffuse), 0.01)
        self.share = dr.minimum(specular / (specular + rest), MOST_SPECULAR_SHARE)

    def masked(self, cosine):
        a2 = self.alpha * self.alpha
        return dr.sqrt(a2 + (1 - a2) * cosine * cosine)

    def value_and_density(self, l):
        """f * cos, and density of the mixture, of a local direction to the light."""
        h = l + self.v
        across, up = h.x * h.x + h.y * h.y, h.z * h.z
        k = self.alpha * (across + up) / (across + self.alpha * self.alpha * up)
        d = k * k * dr.inv_pi
        masked_v, masked_l = self.masked(self.v.z), self.masked(l.z)
        # G2 / (4 cos cos) * cos of the light
        shadowing = 0.5 * l.z / (l.z * masked_v + self.v.z * masked_l)
        fresnel = _schlick(self.f0, 0.5 * dr.norm(h))
        value = self.diffuse * (l.z * dr.inv_pi) + fresnel * (d * shadowing)
        density = self.share * d / (2 * (self.v.z + masked_v)) + (1 - self.share) * l.z * dr.inv_pi
        above = (l.z > 0) & (self.v.z > 0)
        return dr.select(above, value, 0), dr.select(above, density, 0)

    def draw(self, which, u):
        phi = 2 * dr.pi * u.y
        sine, cosine = dr.sincos(phi)
        stretched = dr.normalize(mi.Vector3f(self.alpha * self.v.x, self.alpha * self.v.y, self.v.z))
        z = (1 - u.x) * (1 + stretched.z) - stretched.z
        r = dr.sqrt(dr.maximum(1 - z * z, 0))
        m = mi.Vector3f(r * cosine, r * sine, z) + stretched
        m = dr.normalize(mi.Vector3f(self.alpha * m.x, self.alpha * m.y, m.z))
        mirrored = 2 * dr.dot(self.v, m) * m - self.v
        r = dr.sqrt(u.x)
        lambert = mi.Vector3f(r * cosine, r * sine, dr.sqrt(dr.maximum(1 - u.x, 0)))
        return dr.select(which < self.share, mirrored, lambert)


class ClerestoryBSDF(mi.BSDF):
    """Seen from behind it is the same surface. A shading normal that faces away is black, and so is a direction to the
    light that lies beneath the triangle."""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.texture = _Texture(props)
        vector = lambda name: [float(props[name][i]) for i in range(3)]
        self.colors = [mi.Color3f(*vector("color_" + k)) for k in "abc"]
        self.roughness, self.metallic = mi.Vector3f(*vector("roughness")), mi.Vector3f(*vector("metallic"))
        dr.make_opaque(self.colors, self.roughness, self.metallic)
        self.capped = not props["uncapped"]
        self.smooth_lamp = bool(props["smooth_lamp"])
        both = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        self.m_components = [mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.SpatiallyVarying | both]
        self.m_flags = self.m_components[0]

    def traverse(self, callback):
        pass

    def footprint(self, si, towards_viewer):
        if _eye is None:
            return mi.Float(0)
        origin, spread, axis = _eye
        distance = dr.norm(si.p - origin)  # a sensor's rays begin on its near plane, so si.t is less
        off = si.p + distance * towards_viewer - origin
        if axis is not None:
            spread = spread * dr.power(dr.abs(dr.dot(axis, towards_viewer)), 1.5)
        tilt = dr.rsqrt(dr.maximum(dr.abs(dr.dot(si.n, towards_viewer)), 0.01))
        return dr.select(dr.squared_norm(off) < dr.square(1e-4 + 1e-5 * distance), spread * distance * tilt, 0)

    def material(self, si, towards_viewer, active):
        p = _uvw(si, active)
        footprint = self.footprint(si, towards_viewer)
        b, c, tint = self.texture(p, footprint)
        weights = mi.Vector3f((1 - c) * (1 - b), (1 - c) * b, c)
        metallic = dr.clip(dr.dot(weights, self.metallic), 0, 1)
        most = MOST_DIELECTRIC + (MOST_METAL - MOST_DIELECTRIC) * metallic if self.capped else 1
        color = sum(self.colors[k] * weights[k] for k in range(3))
        return dr.clip(color * tint, 0, most), self.texture.smudged(dr.dot(weights, self.roughness), p, footprint), metallic

    def stand(self, si, active):
        """The lobes, the frame they stand in, and the triangle's normal in it, on the viewer's side."""
        view = si.to_world(si.wi)
        side = dr.select(dr.dot(si.n, view) < 0, mi.Float(-1), mi.Float(1))
        n = si.sh_frame.n
        if self.smooth_lamp:
            n = dr.normalize(mi.Normal3f(si.shape.eval_attribute_3("vertex_shading", si, active)))
        frame = mi.Frame3f(n * side)
        lobes = _Lobes(*self.material(si, view, active), frame.to_local(view))
        return lobes, frame, frame.to_local(mi.Vector3f(si.n * side))

    @staticmethod
    def judged(lobes, face, l):
        value, density = lobes.value_and_density(l)
        return dr.select(dr.dot(face, l) > 0, value, 0), density

    def eval_pdf(self, ctx, si, wo, active=True):
        lobes, frame, face = self.stand(si, active)
        return self.judged(lobes, face, frame.to_local(si.to_world(wo)))

    def eval(self, ctx, si, wo, active=True):
        return self.eval_pdf(ctx, si, wo, active)[0]

    def pdf(self, ctx, si, wo, active=True):
        return self.eval_pdf(ctx, si, wo, active)[1]

    def drawn(self, si, lobes, frame, face, which, u):
        l = lobes.draw(which, u)
        value, density = self.judged(lobes, face, l)
        sample = dr.zeros(mi.BSDFSample3f)
        sample.wo = si.to_local(frame.to_world(l))
        sample.pdf = density
        sample.eta = 1
        sample.sampled_type = +mi.BSDFFlags.GlossyReflection
        sample.sampled_component = 0
        return sample, dr.select(density > 0, value / density, 0)

    def sample(self, ctx, si, sample1, sample2, active=True):
        lobes, frame, face = self.stand(si, active)
        return self.drawn(si, lobes, frame, face, sample1, sample2)

    def eval_pdf_sample(self, ctx, si, wo, sample1, sample2, active=True):
        lobes, frame, face = self.stand(si, active)
        value, density = self.judged(lobes, face, frame.to_local(si.to_world(wo)))
        sample, weight = self.drawn(si, lobes, frame, face, sample1, sample2)
        return value, density, sample, weight

    def to_string(self):
        return f"Clerestory[{self.texture.family}]"


# ---- Window panes ---------------------------------------------------------------------------------------------------


class ClerestoryPane(mi.Emitter):
    """Shows an equirectangular panorama through the front of its shape: centre column along -z, right quarter +x, read
    bilinearly. Points are drawn by area, or where a direction meets the pane that is drawn from what is bright outside."""

    BY_SKY = 0.5

    def __init__(self, props):
        mi.Emitter.__init__(self, props)
        self.m_flags = mi.EmitterFlags.Surface | mi.EmitterFlags.SpatiallyVarying
        factor = props["factor"]
        self.factor = mi.Color3f(*[float(factor[i]) for i in range(3)])
        self.turn = mi.Float(float(props["turn"]) / (2 * dr.pi))
        path = mi.file_resolver().resolve(props["panorama"])
        bitmap = mi.Bitmap(str(path)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)
        self.pixels = mi.TensorXf(bitmap)
        self.height, self.width = self.pixels.shape[0], self.pixels.shape[1]
        self.pixels = self.pixels.array
        dr.make_opaque(self.factor, self.turn, self.pixels)
        self.warp = None

    def traverse(self, callback):
        pass

    def radiance(self, d):
        turns = dr.atan2(d.x, -d.z) * (0.5 * dr.inv_pi) + self.turn + 0.5
        x = (turns - dr.floor(turns)) * self.width - 0.5
        y = dr.acos(dr.clip(d.y, -1, 1)) * (dr.inv_pi * self.height) - 0.5
        x0, y0 = mi.Int32(dr.floor(x)), mi.Int32(dr.floor(y))
        tx, ty = x - dr.floor(x), y - dr.floor(y)

        def at(i, j):
            i = dr.select(i < 0, i + self.width, dr.select(i >= self.width, i - self.width, i))
            j = dr.clip(j, 0, self.height - 1)
            return dr.gather(mi.Color3f, self.pixels, mi.UInt32(j * self.width + i))

        top = dr.lerp(at(x0, y0), at(x0 + 1, y0), tx)
        bottom = dr.lerp(at(x0, y0 + 1), at(x0 + 1, y0 + 1), tx)
        return self.factor * dr.lerp(top, bottom, ty)

    def prepare(self, mesh):
        """Tables of what is bright through the pane, whose mesh this is; until then points are drawn by area alone."""
        corners = np.array(mesh.vertex_positions_buffer()).reshape(-1, 3)
        triangles = [corners[f] for f in np.array(mesh.faces_buffer()).reshape(-1, 3)]
        h, w = self.height, self.width
        up = np.pi * (np.arange(h) + 0.5) / h
        turn = 2 * np.pi * ((np.arange(w + 1) + 0.5) / w - 0.5 - float(self.turn[0]))
        y, across = np.cos(up)[:, None], np.sin(up)[:, None]
        flux = 0
        for a, b, c in triangles:
            n = np.cross(b - a, c - a)  # twice the area long
            flux = flux + np.maximum(-(np.sin(turn) * across * n[0] + y * n[1] - np.cos(turn) * across * n[2]), 0)
        self.area = sum(float(np.linalg.norm(np.cross(b - a, c - a))) for a, b, c in triangles) / 2
        # Numbers of Python: arrays that are made while a kernel is traced do not reach it.
        normal = lambda t: np.cross(t[1] - t[0], t[2] - t[0])
        self.triangles = [tuple(v.tolist() for v in (t[0], t[1] - t[0], t[2] - t[0], normal(t) / np.linalg.norm(normal(t))))
                          for t in triangles]
        bright = np.array(self.pixels).reshape(h, w, 3) @ [0.2126, 0.7152, 0.0722]
        bright = np.concatenate([bright, bright[:, :1]], 1)
        self.warp = mi.Hierarchical2D0(np.ascontiguousarray(flux * bright * across, dtype=np.float32))

    def sky_density(self, d):
        turns = dr.atan2(d.x, -d.z) * (0.5 * dr.inv_pi) + self.turn + 0.5 - 0.5 / self.width
        v = dr.acos(dr.clip(d.y, -1, 1)) * (dr.inv_pi * self.height) - 0.5
        uv = mi.Point2f(turns - dr.floor(turns), v / (self.height - 1))
        sine = dr.sqrt(dr.maximum(1 - d.y * d.y, 1e-8))
        inside = (uv.y >= 0) & (uv.y <= 1)
        scale = self.height / (self.height - 1) / (2 * dr.pi**2)
        return dr.select(inside, self.warp.eval(dr.clip(uv, 0, 1)) * scale / sine, 0)

    def through_sky(self, it, u):
        """A direction from the tables, and how far off the pane lies along it; 0 where it does not."""
        uv, _ = self.warp.sample(u)
        theta = dr.pi * (uv.y * (self.height - 1) + 0.5) / self.height
        phi = 2 * dr.pi * (uv.x + 0.5 / self.width - 0.5 - self.turn)
        sine, cosine = dr.sincos(theta)
        d = mi.Vector3f(dr.sin(phi) * sine, cosine, -dr.cos(phi) * sine)
        distance, normal = mi.Float(0), mi.Normal3f(0, 0, 1)
        for corner, edge, other, n in self.triangles:
            e1, e2 = mi.Vector3f(*edge), mi.Vector3f(*other)
            p, t = dr.cross(d, e2), it.p - mi.Point3f(*corner)
            det = dr.dot(e1, p)
            q = dr.cross(t, e1)
            x, y, z = dr.dot(t, p) / det, dr.dot(d, q) / det, dr.dot(e2, q) / det
            hit = (det > 0) & (x >= 0) & (y >= 0) & (x + y <= 1) & (z > 0) & ((distance == 0) | (z < distance))
            distance = dr.select(hit, z, distance)
            normal = dr.select(hit, mi.Normal3f(*n), normal)
        return d, distance, normal

    def eval(self, si, active=True):
        return dr.select(mi.Frame3f.cos_theta(si.wi) > 0, self.radiance(-si.to_world(si.wi)), 0)

    def density(self, by_area, d):
        return by_area if self.warp is None else (1 - self.BY_SKY) * by_area + self.BY_SKY * self.sky_density(d)

    def sample_direction(self, it, sample, active=True):
        u = mi.Point2f(sample)
        if self.warp is not None:
            by_sky = u.x < self.BY_SKY
            u.x = dr.select(by_sky, u.x / self.BY_SKY, (u.x - self.BY_SKY) / (1 - self.BY_SKY))
        ds = self.get_shape().sample_direction(it, u, active)
        if self.warp is not None:
            d, distance, normal = self.through_sky(it, u)
            ds.d = dr.select(by_sky, d, ds.d)
            ds.dist = dr.select(by_sky, distance, ds.dist)
            ds.n = dr.select(by_sky, normal, ds.n)
            ds.p = dr.select(by_sky, it.p + d * distance, ds.p)
            cosine = dr.maximum(-dr.dot(ds.d, ds.n), 1e-8)
            ds.pdf = dr.select(by_sky, dr.square(distance) / (cosine * self.area), ds.pdf)
        ds.emitter = mi.EmitterPtr(self)
        ok = active & (dr.dot(ds.d, ds.n) < 0) & (ds.pdf > 0)
        ds.pdf = dr.select(ok, self.density(ds.pdf, ds.d), 0)
        return ds, dr.select(ok, self.radiance(ds.d) / ds.pdf, 0)

    def pdf_direction(self, it, ds, active=True):
        by_area = self.get_shape().pdf_direction(it, ds, active)
        return dr.select(dr.dot(ds.d, ds.n) < 0, self.density(by_area, ds.d), 0)

    def eval_direction(self, it, ds, active=True):
        return dr.select(dr.dot(ds.d, ds.n) < 0, self.radiance(ds.d), 0)

    def bbox(self):
        return self.get_shape().bbox()

    def to_string(self):
        return "ClerestoryPane[]"


def prepare(scene):
    """To be called once a scene is loaded: the tables of its texture coordinates and of what is bright outside."""
    global _uvw
    _uvw = _Coordinates(scene.shapes())
    for shape in scene.shapes():
        if isinstance(shape.emitter(), ClerestoryPane):
            shape.emitter().prepare(shape)


mi.register_bsdf("clerestory", lambda props: ClerestoryBSDF(props))
mi.register_emitter("clerestory_pane", lambda props: ClerestoryPane(props))
