"""Bodies of elements, materials, colliders, skinning: forces from positions."""
