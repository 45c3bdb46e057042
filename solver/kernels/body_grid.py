"""Bodies near each other: a hashed grid of their centres, then their bounding boxes."""

from solver.backend import ti
from solver.state import Ints3, Vec3


@ti.func
def bound(s: ti.template(), w, b):
    """Bounding box of one body, from its member spheres, none of which is listed yet."""
    low, high = s.body.position[w, b], s.body.position[w, b]
    for m in range(s.body.first[w, b], s.body.first[w, b] + s.body.members[w, b]):
        s.member.listed[w, m] = 0
        r = Vec3(1.0, 1.0, 1.0) * s.member.radius[w, m]
        low = ti.min(low, s.member.centre[w, m] - r)
        high = ti.max(high, s.member.centre[w, m] + r)
    s.body.low[w, b] = low
    s.body.high[w, b] = high


@ti.func
def bucket(s: ti.template(), c):
    """Hash of a cell's whole-number coordinates (Teschner et al. 2003, Optimized spatial hashing)."""
    return ((c[0] * 73856093) ^ (c[1] * 19349663) ^ (c[2] * 83492791)) & (s.grid.bucket.shape[1] - 1)


@ti.func
def fill_grid(s: ti.template(), w):
    """Sort bodies into the hashed grid by their centres. Cells are as long as the largest body, grip and margins."""
    for h in range(s.grid.bucket.shape[1]):
        s.grid.bucket[w, h] = -1
    for b in range(s.world.bodies[w]):
        if s.body.alive[w, b] == 1:
            h = bucket(s, ti.floor(s.body.position[w, b] / s.world.cell[w], ti.i32))
            s.body.next[w, b] = s.grid.bucket[w, h]
            s.grid.bucket[w, h] = b


@ti.func
def find_near(s: ti.template(), w, a):
    """Bodies after ``a`` whose bounding boxes are within both margins of its own, ascending; returns how many."""
    reach = s.body.margin[w, a] + s.world.grip[w]
    low, high = s.body.low[w, a] - reach, s.body.high[w, a] + reach
    home = ti.floor(s.body.position[w, a] / s.world.cell[w], ti.i32)
    near = 0
    for c in range(27):
        h = bucket(s, home + Ints3(c % 3 - 1, (c // 3) % 3 - 1, c // 9 - 1))
        b = s.grid.bucket[w, h]
        while b > a:  # a bucket's bodies descend
            margin = s.body.margin[w, b]
            other_low, other_high = s.body.low[w, b] - margin, s.body.high[w, b] + margin
            apart = 0
            for d in ti.static(range(3)):
                if other_low[d] > high[d] or other_high[d] < low[d]:
                    apart = 1
            if apart == 0:
                # Keep the list ascending; two cells may share a bucket, and a body come twice.
                at = near
                while at > 0 and s.body.near[w, at - 1] > b:
                    at -= 1
                if at == 0 or s.body.near[w, at - 1] != b:
                    for k in range(near - at):
                        s.body.near[w, near - k] = s.body.near[w, near - k - 1]
                    s.body.near[w, at] = b
                    near += 1
            b = s.body.next[w, b]
    return near
