//! Robot models that never change after loading: links, joints, tree, spatial algebra, kinds of number.
